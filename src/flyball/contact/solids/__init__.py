"""From points, meshes and heights to what stands in the tables: done once, in NumPy, before anything moves."""
