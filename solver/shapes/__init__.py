"""The shape of a body: its true solid, the member spheres that represent it, and their errors. NumPy only."""
