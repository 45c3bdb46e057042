"""The tab of what is taken along: the command line, files, recordings."""
