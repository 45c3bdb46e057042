"""A project: one granular material from its file to its report, as a folder, with the progress of each step."""
