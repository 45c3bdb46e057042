"""Stages of a study, in the order in which they run; each takes what came before and returns a frozen result."""
