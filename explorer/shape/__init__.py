"""A mesh becomes a body of spheres."""
