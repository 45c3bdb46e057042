"""Diagnosis: from measured summaries and simulated runs to what the model lacks, if anything (README.md).

`diagnosis.py` is the whole loop with its pours, `posterior.py` the judgement on pours that are there.
"""
