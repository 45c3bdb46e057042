"""The tabs of calibration and diagnosis: commands in the background, their stages, charts and results."""
