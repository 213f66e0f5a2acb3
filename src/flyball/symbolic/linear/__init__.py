"""Linear equations as expressions: state space, transfer functions, conditions of stability."""
