"""The model that a measurement declares, and its pours.

`model.py` says what varies, `points.py` which pours there are, `budget.py` how many, and `pours.py` makes, stores and
reads them. The diagnosis, its validation and `explorer limit` use all four.
"""
