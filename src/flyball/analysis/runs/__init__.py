"""Many runs of one model: which points, what is read of a run, and who computes them."""
