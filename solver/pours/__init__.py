"""A pour from its scene to its record: how bodies are fed, when it is over, what is kept, many pours side by side."""
