"""What commands print: plain tables for a terminal, and the same as plain data."""
