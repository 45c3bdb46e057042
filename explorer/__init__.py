"""The interface: command line, live page, recordings and reports."""
