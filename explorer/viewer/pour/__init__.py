"""The tab of the pour: run it, read it, change its parameters and its set-up."""
