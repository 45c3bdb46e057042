"""Made-up laboratories: data with a truth that the diagnosis cannot read, and how often it finds it."""
