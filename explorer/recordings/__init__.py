"""Recordings (rerun): written while a pour runs, replayed without the program. The only home of rerun."""
