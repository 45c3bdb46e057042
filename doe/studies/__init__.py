"""A study: what its file asks for, the chain of its stages, and what came of it."""
