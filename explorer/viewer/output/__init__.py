"""The tab for exports: the command line, files, recordings."""
