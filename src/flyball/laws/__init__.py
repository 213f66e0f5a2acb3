"""Laws: expressions as bytecode, its evaluation, and calls of Python functions from it.

`compilation` translates an expression tree to bytecode, `bytecode` evaluates it inside compiled loops, with the first
two time derivatives for drivers: a new law needs no compilation. `python_functions` compiles users' functions, or calls
them back, by an address in the bytecode. `breakpoints` finds the times of corners, jumps and brief pulses that depend
on time alone, by interval arithmetic (`interval_evaluation`, `interval_arithmetic`) and before a motion begins, so that
none of them has to be found by sampling.

Corners that depend on the state become switches of kind `CORNER`: the law reads the side in place of ``sign(u)``, so it
is smooth on either side; a branch is not continued beyond the domain of its functions. A new function is an operation
of `bytecode` and its enclosure in `interval_arithmetic`. Imports NumPy, `compiler`, `math` and `model` only.
"""
