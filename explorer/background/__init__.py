"""Commands of the command line that run beside the page."""
