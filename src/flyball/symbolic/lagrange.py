"""Lagrange's equations: the equations of motion from the energies, to compare with the Newton-Euler equations.

In quasi-velocities v, qdot = T v, with the kinetic energy K(q, v), the potential V(q), the generalised forces Q
of all elements without a potential, and the constraints' G^T lam:

    d/dt dK/dv + w x dK/dw - T^T dK/dq + T^T dV/dq = Q + G^T lam

(Hamel 1904; Boltzmann 1902). The second term stands for every body or joint that rotates about a point, whose
angular velocity w is in its own axes. Where all velocities are rates of coordinates it vanishes, T is the
identity, and these are Lagrange's equations of the second kind, with constraints those of the first kind. Without
constraints they equal the equations without multipliers.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.kinematics import quaternion_at
from ..expression_graph.graph import jacobian, object_vector
from ..math.vec import cross
from .expressions import Expressions
from .named_equations import generalised_forces

if TYPE_CHECKING:
    from .equations import Equations


class Lagrange:
    """Equations of motion by Lagrange's formalism, in the form M vdot = f + G^T lam.

    Attributes
    ----------
    kinetic, potential : Expressions
        Energies [J] of the bodies, and of gravity and the conservative forces.
    forces : Expressions
        Q, generalised forces of all other elements along the velocities, by their virtual power.
    momenta : Expressions
        dK/dv.
    M, f : Expressions
        Mass matrix d2K/dv2, and all that does not depend on accelerations and multipliers.
    """

    def __init__(self, equations: Equations) -> None:
        self.equations = equations

    @cached_property
    def kinetic(self) -> Expressions:
        """K [J]."""
        return self.equations["energy.kinetic"]

    @cached_property
    def potential(self) -> Expressions:
        """V [J]."""
        eq = self.equations
        out = eq["energy.gravity"]
        for e in eq.model.forces:
            if e.conservative():
                out = out + eq[f"{e.name}.energy"]
        return out

    @cached_property
    def forces(self) -> Expressions:
        """Q along the velocities, (nv,) [N, N m]."""
        x = self.equations.named_equations
        total = object_vector([0.0] * len(x.traced.v))
        own = generalised_forces(x)[-len(x.traced.structure.forces) :] if x.traced.structure.forces else []
        for e, (_, f) in zip(x.traced.structure.forces, own, strict=True):
            if not e.conservative():
                total = total + f
        return self._vector(total)

    @cached_property
    def momenta(self) -> Expressions:
        """dK/dv, (nv,)."""
        return self._vector(self._by(self.kinetic, self.equations.named_equations.traced.v))

    @cached_property
    def M(self) -> Expressions:
        """Mass matrix, (nv, nv)."""
        v = self.equations.v
        made = jacobian(self.momenta.list(), self.equations.named_equations.traced.v)
        return Expressions(self.equations, made, v.rows, v.rows)

    @cached_property
    def f(self) -> Expressions:
        """Right-hand side without G^T lam, (nv,)."""
        x = self.equations.named_equations.traced
        rates = x.T @ object_vector(x.v)
        moved = jacobian(self.momenta.list(), x.q) @ rates
        energy = self.kinetic - self.potential
        driving = x.T.T @ object_vector(self._by(energy, x.q))
        return self._vector(driving - moved - self._turned() + self.forces.nodes)

    @property
    def residual(self) -> Expressions:
        """M vdot - f - G^T lam, (nv,): zero along every motion."""
        eq = self.equations
        return self.M @ eq.vdot - self.f - eq.G.T @ eq.lam

    def _turned(self) -> np.ndarray:
        """Terms w x dK/dw of everything that rotates about a point."""
        x = self.equations.named_equations.traced
        out = object_vector([0.0] * len(x.v))
        p = self.momenta.list()
        for b in range(len(x.system.tree.parent)):
            _, at = quaternion_at(x.system, b)
            if at >= 0:
                out[at : at + 3] = cross(tuple(x.v[at : at + 3]), tuple(p[at : at + 3]))
        return out

    def _by(self, energy: Expressions, symbols: list[Any]) -> list[Any]:
        return jacobian(energy.list(), symbols)[0].tolist()

    def _vector(self, nodes: Any) -> Expressions:
        made = nodes if isinstance(nodes, np.ndarray) else object_vector(nodes)
        return Expressions(self.equations, made, self.equations.v.rows)

    def __repr__(self) -> str:
        return f"<Lagrange's equations of {self.equations.title}: {len(self.equations.v)} velocities>"
