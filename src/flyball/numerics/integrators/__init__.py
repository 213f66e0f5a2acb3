"""Time integration methods and the one time loop that runs them; no mechanics.

`time_loop` holds the step state and the loop: output, step count limits, rejected steps, the end. A step method
implements the tasks of the loop: `explicit_runge_kutta` for any pair given as a tableau, `implicit_method` for
Radau IIA and generalised-alpha, `variational` for a symplectic method.

Explicit methods are data: a new one is an entry of `butcher_tableaux.TABLEAUX` (`runge_kutta` defines one). A
new implicit method is a module with functions to attempt, interpolate, accept and reject a step. The functions that
a method evaluates are passed as callbacks. Imports: NumPy, `compiler/`, `math/`, `numerics/`.

The dense output of ``dop853`` is wrong by 20 to 1000 tolerances where stability limits steps, so its own error is
checked whenever a step is interpolated. If two steps in a row are rejected, the step is repeated from a state that
differs by 1e-14: if the error changes, it is rounding, and shorter steps do not help.
"""

from __future__ import annotations
