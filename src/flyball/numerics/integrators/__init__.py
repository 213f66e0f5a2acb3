"""Time integration methods and the one time loop that runs them; no mechanics.

`time_loop` holds the step state and the loop: output, step count limits, rejected steps, the end. A step method
implements the tasks of the loop: `explicit_runge_kutta` for any pair given as a tableau, `implicit_method` for
Radau IIA and generalised-alpha, `variational` for a symplectic method.

Explicit methods are data: a new one is an entry of `butcher_tableaux.TABLEAUX` (`runge_kutta` defines one). A
new implicit method is a module with functions to attempt, interpolate, accept and reject a step. The functions that
a method evaluates are passed as callbacks. Imports: NumPy, `compiler/`, `math/`, `numerics/`.

The dense output of ``dop853`` misses by 20 to 1000 tolerances where stability limits steps, so its own error is judged
whenever something is read within a step. Where a second step in a row is rejected, it is repeated from a state 1e-14
away: an error that differs is rounding, and shorter steps do not help.
"""

from __future__ import annotations
