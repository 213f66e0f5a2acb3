"""A mechanism as arrays: from the model to integers (structure) and floats (values). Nothing here is compiled."""
