"""Scenes as people name, change, draw and write them."""
