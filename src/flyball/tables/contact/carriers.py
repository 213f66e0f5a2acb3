"""What carries shapes and moves, in arrays: where it is as drawn, how fast, and what it weighs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...contact.tables import Movers
from ...errors import ModelError
from ...model.bulk import Bodies
from ...model.model import Model
from ..numbers import Numbers


@dataclass(frozen=True)
class Carriers:
    """Bodies, and many bodies, in the order in which they were asked for.

    A mover's origin is its centre of mass, its axes are those of its reference frame.

    Attributes
    ----------
    names : tuple of str
    slices : dict
        Name -> the movers that it is.
    movers : Movers
        As drawn and told; velocities are those of the centres of mass.
    mass : (n,) [kg]
    inertia : (n, 3, 3) [kg m^2]
        About the centre of mass, in the mover's axes.
    com : dict
        Name -> its centre of mass [m] in its reference frame; of many bodies, with ``scale`` 1.
    """

    names: tuple[str, ...]
    slices: dict[str, slice]
    movers: Movers
    mass: np.ndarray
    inertia: np.ndarray
    com: dict[str, np.ndarray]

    def name(self, mover: int) -> str:
        """What a mover is called in messages and results: ``"crank"`` or ``"balls[17]"``; ``"ground"`` for -1."""
        for name, at in self.slices.items():
            if at.start <= mover < at.stop:
                return name if name in self.single else f"{name}[{mover - at.start}]"
        return "ground"

    single: frozenset[str] = frozenset()


def carriers(model: Model, given: Numbers, names: Sequence[str]) -> Carriers:
    """The bodies of these names, one after the other, each of many bodies at its place.

    Raises
    ------
    ModelError
        If there is no such body.
    """
    parts, slices, com, at = [], {}, {}, 0
    for name in names:
        e = model.find(name)
        part, com[name] = _many(e, model, given) if isinstance(e, Bodies) else _single(name, given)
        slices[name] = slice(at, at + len(part[0]))
        at = slices[name].stop
        parts.append(part)
    if not parts:
        parts = [tuple(np.zeros((0, *s)) for s in ((3,), (3, 3), (3,), (3,), (), (3, 3)))]
    p, R, v, w, mass, inertia = (np.concatenate(x) for x in zip(*parts, strict=True))
    movers = Movers(np.hstack([p, R.reshape(-1, 9)]), np.hstack([v, w]))
    single = frozenset(name for name in names if not isinstance(model.find(name), Bodies))
    return Carriers(tuple(names), slices, movers, mass, inertia, com, single)


def _single(name: str, given: Numbers) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    if name not in given.bodies:
        raise ModelError(f"there is no body named {name!r}")
    b = given.bodies[name]
    inertia = np.real(b.inertia).reshape(3, 3)
    row = (b.c, b.R, b.v, b.w, b.mass, inertia)
    return tuple(np.real(np.asarray(x, float))[None] for x in row), np.real(b.com)


def _many(e: Bodies, model: Model, given: Numbers) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Lengths grow with the scale, masses with its cube, inertias with its fifth power."""
    one = e.weight(given.of[e.name], given.env, model.planar)
    p, R, v, w = e.start(model.planar)
    s = e.sizes()
    com = np.real(one.com)
    arm = s[:, None] * (R @ com)
    mass = np.real(one.mass) * s**3
    inertia = (s**5)[:, None, None] * np.real(one.inertia)
    return (p + arm, R, v + np.cross(w, arm), w, mass, inertia), com
