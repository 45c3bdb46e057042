"""The model that a measurement declares, and its pours.

What is varied (`model.py`), which pour is that (`points.py`), how many there are (`budget.py`), how one is made, kept
and read (`pours.py`). The diagnosis, its validation and `explorer limit` ask for them.
"""
