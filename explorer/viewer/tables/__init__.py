"""NiceGUI pages next to the main page: tables to fill in, and pictures to click."""
