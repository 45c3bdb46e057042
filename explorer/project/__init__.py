"""A project: one granular material from its file to its report, as a folder, and how far each step of it is."""
