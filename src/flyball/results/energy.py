"""Energy over time, and the balance that it has to keep."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..math.vec import dot, mtv, mv
from ..model.force import Force
from ..model.quantities import ENERGY, Quantity, quantities
from ..model.touch import Touch
from .booked import GIVEN, basis
from .views.base import Named

if TYPE_CHECKING:
    from .result import Result


EXCHANGED = {"friction_loss": -1.0, "impact_loss": -1.0, "surface_work": 1.0, "numerical_loss": -1.0}
"""Energies that contacts exchange, and by which sign the bodies have them.

The last is the error of impulse time stepping: what the method itself took.
"""
STORED = "contact_elastic"
"""Energy stored in contacts that give way, among what contacts exchange."""


def kinetic(result: Result, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
    """Sum of m v^2 / 2 + w . I w / 2 over rows of the body table [J]."""
    _, R, w, v, _, _ = result.motions.bodies(bodies)
    return _of_speeds(result, bodies, R, w, v)


def gained(result: Result, bodies: Sequence[int] | np.ndarray, time: float) -> np.ndarray:
    """Kinetic energy [J] that the accelerations at every output time give bodies at rest in a time [s]."""
    _, R, _, _, alpha, a = result.records.bodies(bodies)
    return time**2 * _of_speeds(result, bodies, R, alpha, a)


def _of_speeds(result: Result, bodies: Sequence[int] | np.ndarray, R: tuple, w: tuple, v: tuple) -> np.ndarray:
    table = result.values.system.bodies
    w_B, inertia = mtv(R, w), tuple(table.inertia[bodies].T[..., None])
    return (0.5 * table.mass[bodies, None] * dot(v, v) + 0.5 * dot(w_B, mv(inertia, w_B))).sum(axis=0)


def gravity(result: Result, bodies: Sequence[int] | np.ndarray) -> np.ndarray:
    """Potential energy of gravity of rows of the body table [J]."""
    S = result.values.system
    return -(S.bodies.mass[bodies][:, None] * dot(tuple(S.gravity), result.motions.bodies(bodies)[0])).sum(axis=0)


class Energy(Named):
    """Energies of a motion [J]: kinetic, potential (gravity and springs), and the work done from outside."""

    instead: ClassVar = {"work": "the work of each part is part.work; all of them are in result.energy.work"}

    def __init__(self, result: Result) -> None:
        self._result = result

    @property
    def title(self) -> str:
        """What it is called."""
        return ENERGY

    @property
    def names(self) -> dict[str, Quantity]:
        """Everything that it has, by name."""
        return quantities(self._result.model, ENERGY)

    @cached_property
    def _bodies(self) -> list[int]:
        """Rows of the body table, but for bodies that stand for something else."""
        s = self._result.values.structure
        aside = {s.place[name] for name in s.model.aside if name in s.place}
        return [b for b in range(len(self._result.values.system.tree.parent)) if b not in aside]

    @cached_property
    def kinetic(self) -> np.ndarray:
        """Sum of m v^2 / 2 + w . I w / 2 over the bodies."""
        if self._result.pieces:
            return self._of_pieces("kinetic")
        return sum((b.kinetic for b in self._result.bulk.values()), kinetic(self._result, self._bodies))

    @cached_property
    def gravity(self) -> np.ndarray:
        """Potential energy of gravity, zero where every centre of mass lies in the world's origin."""
        if self._result.pieces:
            return self._of_pieces("gravity")
        S = self._result.values.system
        total = gravity(self._result, self._bodies)
        return sum((b.potential(S.gravity) for b in self._result.bulk.values()), total)

    @cached_property
    def elastic(self) -> np.ndarray:
        """Energy stored in springs, and in contacts that give way."""
        return sum((self._result[f.name].energy for f in self._result.model.acting()), self.exchanged(STORED))

    @property
    def potential(self) -> np.ndarray:
        """Gravity and springs."""
        return self.gravity + self.elastic

    @property
    def total(self) -> np.ndarray:
        """Kinetic and potential."""
        return self.kinetic + self.potential

    @cached_property
    def work(self) -> dict[str, np.ndarray]:
        """Work that each damper, actuator, motor, given force and driver has put in since the start.

        What a spring inside the same element stores is not counted: it is in the potential energy. Nor is what a
        change of its stiffness gave it, which an event did.
        """
        out = {}
        r = self._result
        for name in r.values.structure.states:
            if name.endswith(".work"):
                element = r[name.removesuffix(".work")]
                own = element.element
                stores = isinstance(own, Force) and own.energy is not None
                out[own.name] = element.work + (element.energy - basis(r, own.name) if stores else 0.0)
        return out

    def _of_pieces(self, name: str) -> np.ndarray:
        """One of the energies, where parameters changed on the way."""
        return np.concatenate([getattr(p.energy, name) for p in self._result.pieces])

    def exchanged(self, name: str) -> np.ndarray:
        """Energy since the start that contacts and events lost or gave, by its name; zeros where there are none."""
        found = self._result.exchanged.get(name)
        return self._result.motions.zeros() if found is None else found

    def _friction_loss(self) -> np.ndarray:
        """Lost in friction of contacts since the start: that of places is a work, integrated with the motion."""
        r = self._result
        at = r.values.structure.state_at
        own = (at.get(f"{e.name}.work") for e in r.values.structure.model.forces if isinstance(e, Touch))
        return sum((-r.states[:, k] for k in own if k is not None), self.exchanged("friction_loss"))

    def _found(self, name: str) -> np.ndarray:
        return self._friction_loss() if name == "friction_loss" else self.exchanged(name)

    @cached_property
    def balance(self) -> np.ndarray:
        """Total energy less all work put in less the total at the start: zero for an exact motion."""
        if not len(self._result.t):
            return np.zeros(0)
        put_in = sum(self.work.values(), self._result.motions.zeros())
        put_in = sum((sign * self.exchanged(k) for k, sign in (*EXCHANGED.items(), (GIVEN, 1.0))), put_in)
        residue = self.total - put_in
        return residue - residue[0]

    @property
    def drift(self) -> float:
        """Largest deviation from the balance [J]; nan where fewer than two output times leave nothing to compare."""
        return float(np.abs(self.balance).max()) if len(self._result.t) > 1 else float("nan")
