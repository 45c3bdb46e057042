"""The live page in a browser (viser): a scene of the pour, and one file per panel. Never imports Taichi."""
