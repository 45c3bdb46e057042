"""Boards: the results of a study or a diagnosis, finished or at work, as one page of verdict, charts and tables."""
