"""Boards: the results of a study or diagnosis, finished or running, as one page of verdict, charts and tables."""
