"""Motion by steps of impulses: what `Mechanism.simulate` does where things touch."""
