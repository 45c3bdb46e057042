"""From photographs of a pile to angles: what `explorer measure` does. The pictures are read by `solver/photograph`."""
