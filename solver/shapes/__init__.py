"""The shape of a body: its true solid, the member spheres that stand for it, and what they get wrong. NumPy only."""
