"""Diagnosis: from measured summaries and simulated runs to what the model lacks, if anything (README.md).

`diagnosis.py` runs the whole loop with its pours; `posterior.py` weighs the models by the pours already made.
"""
