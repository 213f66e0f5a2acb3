"""The engine's own loops run in plain Python on expressions."""
