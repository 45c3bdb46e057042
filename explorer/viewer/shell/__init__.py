"""What stands around viser's page: the state line above it, the timeline below it, and pages of our own beside it."""
