"""Diagnosis: from measured summaries and simulated runs to what the model lacks, if anything.

`diagnose` (decide.py) is the whole chain. Pure NumPy and SciPy: simulations are made elsewhere.
"""
