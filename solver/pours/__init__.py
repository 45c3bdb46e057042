"""A pour from its scene to its record: how bodies are supplied, when it is over, what is kept, many side by side."""
