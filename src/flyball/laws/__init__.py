"""Laws: expressions as bytecode, one instruction set and its readers, and calls of Python functions from it.

`compilation` turns an expression tree into bytecode, `bytecode` evaluates it inside compiled loops, with the first two
time derivatives for drivers: a new law compiles nothing. `python_functions` compiles functions of users, or calls them
back, by an address in the bytecode. `breakpoints` finds the times of corners, jumps and brief pulses that depend on
time alone, by interval arithmetic (`interval_evaluation`, `interval_arithmetic`) and before a motion begins, so that
nothing of them is sampled.

Corners that depend on the state become switches of kind BRANCH: the law reads the side in place of ``sign(u)``, so it
is smooth on either side; a branch is not continued beyond the domain of its functions. A new function is an operation
of `bytecode` and its enclosure in `interval_arithmetic`. Imports NumPy, `compiler`, `math` and `model` only.
"""
