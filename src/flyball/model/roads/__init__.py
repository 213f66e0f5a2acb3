"""Roads for tyres: planes, height fields and profiles, one kind of surface in a file."""
