"""Pages of NiceGUI beside the page: tables that are filled in, and pictures that are clicked."""
