"""Where energy goes in impacts of the mechanism beside contacts: reactions of joints, the end of the step.

Impulses are found where joints are at half the step, and bodies are then put onto them at its end: velocities by the
nearest ones there are, measured by the masses, which takes energy and never gives any; positions likewise, by lifts
and weights moved. All this is of the order of the step, and is there only where something is hit or touches; impacts
themselves take nothing at joints, so that it is the method's.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..equations.rows import row_times
from ..math.vec import dot, load3, load9, mtv, mv


@formula
def kinetic(A):
    """Kinetic energy at the kinematics in the engine's room."""
    total = 0.0
    for b in range(A.S.tree.parent.shape[0]):
        v, w = load3(A.W.BK, b, 15), mtv(load9(A.W.BK, b, 3), load3(A.W.BK, b, 12))
        total += 0.5 * A.S.bodies.mass[b] * dot(v, v) + 0.5 * dot(w, mv(load9(A.S.bodies.inertia, b, 0), w))
    return total


@formula
def weighed(A, column):
    """Sum of m g . x, x in three columns of the bodies' kinematics: places from 0 on, velocities from 15 on."""
    total = 0.0
    for b in range(A.S.tree.parent.shape[0]):
        x = load3(A.W.BK, b, column)
        total += A.S.bodies.mass[b] * (A.S.gravity[0] * x[0] + A.S.gravity[1] * x[1] + A.S.gravity[2] * x[2])
    return total


@formula
def reactions_work(A, lam, v):
    """Work of joints' impulses of impacts at velocities v, beyond that of what is prescribed."""
    for r in range(A.S.rows.law.shape[0]):
        A.real.astray -= lam[r] * (row_times(A.S, A.W, r, v) - A.W.rows.nu[r])


@formula
def weigh_mean(A, h):
    """Keep gravity's work over the step at the mean velocities, at which impulses' works are taken too."""
    A.real.weighed = h * weighed(A, 15)


@formula
def settle_account(A):
    """At the end of the step, where something was hit: what putting onto the joints took."""
    now = -weighed(A, 0)
    if A.real.kinetic >= 0.0:
        A.real.astray += A.real.kinetic - kinetic(A) - (now - A.real.potential) - A.real.weighed
    A.real.potential = now
