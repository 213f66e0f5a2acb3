"""From equations with constraints to explicit ones: dependent coordinates solved for, state space."""
