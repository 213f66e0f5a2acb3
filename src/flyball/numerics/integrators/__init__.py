"""Time integration methods and the one time loop that runs them; no mechanics.

`time_loop` holds the step state and the loop: output, step count limits, rejected steps, the end. A step method
answers the tasks of the loop: `explicit_runge_kutta` any pair given as a tableau, `implicit_method` Radau IIA
and generalised-alpha, `variational` a symplectic method.

Explicit methods are data: a new one is an entry of `butcher_tableaux.TABLEAUX` (`runge_kutta` defines one). A
new implicit method is a module with functions to attempt, interpolate, accept and reject a step. What a method
evaluates is passed in as callbacks. Imports: NumPy, `compiler/`, `math/`, `numerics/`.
"""

from __future__ import annotations
