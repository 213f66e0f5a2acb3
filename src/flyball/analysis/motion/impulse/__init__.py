"""Motion by impulses: a model made into tables of the step, and what comes of it."""
