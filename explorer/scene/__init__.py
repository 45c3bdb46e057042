"""Naming, changing, drawing and writing scenes."""
