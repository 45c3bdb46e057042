"""The declaration of a pour: bodies, materials, contacts and settings, and their files. NumPy only."""
