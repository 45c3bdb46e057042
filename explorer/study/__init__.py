"""A calibration: from its order to its files, changed, watched, and read again."""
