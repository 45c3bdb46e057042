"""More seeds of one scene: pours that tell how far a single one can be trusted."""
