"""What is poured: bodies, materials, contacts and settings as declared, and the files they are read from. NumPy only."""
