"""A calibration: from its order to its files; edited, watched, and read back."""
