"""Files that commands and the page write and read."""
