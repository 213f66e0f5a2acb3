"""Linear and angular momentum of bodies, groups of bodies, and the whole mechanism over time."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import ModelError
from ..math.vec import add, cross, mtv, mv, scale, sub
from ..model.body import Body, Frame
from ..model.expressions import number
from ..model.messages import listing, suggest
from .part_views.base import components_array
from .part_views.bodies import BodySetMotion
from .wording import range_text

if TYPE_CHECKING:
    from .result import Result

MASS_CENTRE = "com"
"""Name of the point that is the common mass centre of the bodies."""


@dataclass(repr=False)
class Momentum:
    """Momentum of bodies over time, world axes.

    Attributes
    ----------
    t : ndarray (n,) [s]
    bodies : tuple of str
        Names of the bodies and sets of bodies.
    about : str
        The point of the angular momentum.
    linear : ndarray (n, 2) or (n, 3) [kg m/s]
        Sum of m v.
    angular : ndarray (n,) in the plane, or (n, 3) [kg m^2/s]
        Sum of r x m v + I w, with r from the point to the mass centre of each body, and v relative to the world, also
        about a point that moves.
    centre : ndarray (n, 2) or (n, 3) [m]
        Common mass centre; nan without mass.
    """

    t: np.ndarray
    bodies: tuple[str, ...]
    about: str
    linear: np.ndarray
    angular: np.ndarray
    centre: np.ndarray

    def lines(self) -> list[tuple[str, str]]:
        """The bodies, the point, and the ranges of both momenta."""
        axes = ("x", "y", "z")
        linear = [(f"linear {axes[k]}", f"{range_text(x)} kg m/s") for k, x in enumerate(self.linear.T)]
        turning = np.atleast_2d(self.angular.T)
        names = axes if len(turning) == 3 else axes[2:]
        angular = [(f"angular {n}", f"{range_text(x)} kg m^2/s") for n, x in zip(names, turning, strict=True)]
        return [("bodies", ", ".join(self.bodies)), ("about", self.about), *linear, *angular]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        own = {k: getattr(self, k).tolist() for k in ("t", "linear", "angular", "centre")}
        return {"bodies": list(self.bodies), "about": self.about} | own

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Both momenta over time; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.result_plots import momentum_plot

        return momentum_plot(self, path)

    def __repr__(self) -> str:
        width = max(len(label) for label, _ in self.lines())
        return "\n".join(f"{label:<{width}}  {text}" for label, text in self.lines())


class _Bodies(NamedTuple):
    """Masses (m, 1), central inertias as nine arrays (m, 1), and kinematics (m, n) of some bodies."""

    mass: np.ndarray
    inertia: tuple[np.ndarray, ...]
    p: tuple[np.ndarray, ...]
    R: tuple[np.ndarray, ...]
    w: tuple[np.ndarray, ...]
    v: tuple[np.ndarray, ...]

    def spin(self) -> tuple[np.ndarray, ...]:
        """Angular momentum of each about its own mass centre, world axes."""
        return mv(self.R, mv(self.inertia, mtv(self.R, self.w)))


def result_momentum(result: Result, names: Iterable[str], about: Any) -> Momentum:
    """Momentum of the named bodies and sets of bodies, of all if none is named, about a point.

    Raises
    ------
    ModelError
        If a name is no body or set of bodies, or is given twice; or ``about`` is no point.
    """
    chosen = _checked_names(result, tuple(names))
    if result.pieces:  # masses differ between the pieces
        parts = [result_momentum(p, chosen, about) for p in result.pieces]
        joined = [np.concatenate([getattr(m, k) for m in parts]) for k in ("linear", "angular", "centre")]
        return Momentum(result.t, chosen, parts[0].about, *joined)
    groups = [*_table_bodies(result, chosen), *_set_members(result, chosen)]
    centre = _mass_centre(groups, len(result.t))
    point, title = _point(result, about, centre)
    none = (result.motions.zeros(),) * 3
    linear = angular = none
    for g in groups:
        p = scale(g.mass, g.v)
        moment = add(cross(sub(g.p, point), p), g.spin())
        linear = add(linear, tuple(x.sum(axis=0) for x in p))
        angular = add(angular, tuple(x.sum(axis=0) for x in moment))
    planar = result.planar
    turning = angular[2] if planar else np.stack(angular, axis=1)
    return Momentum(
        result.t, chosen, title, components_array(linear, planar), turning, components_array(centre, planar)
    )


def _checked_names(result: Result, names: tuple[str, ...]) -> tuple[str, ...]:
    own = [*result.values.structure.place, *result.bulk]
    own = [n for n in own if n in result.bulk or result.values.structure.place[n] >= 0]
    for k, name in enumerate(names):
        if not isinstance(name, str):
            raise ModelError(f"momentum: bodies are given by name, not by {name!r}")
        if name not in own and result.set_of_bodies(name) is None:
            raise ModelError(f"momentum: there is no moving body {name!r}{suggest(name, own)}; {listing(own)}")
        if name in names[:k]:
            raise ModelError(f"momentum: {name!r} is given twice")
    return names or tuple(own)


def _table_bodies(result: Result, names: tuple[str, ...]) -> list[_Bodies]:
    """Those of the bodies that have rows in the body table."""
    place, table = result.values.structure.place, result.values.system.bodies
    rows = np.array([place[n] for n in names if n in place], np.int64)
    if not len(rows):
        return []
    p, R, w, v, _, _ = result.motions.bodies(rows)
    return [_Bodies(table.mass[rows, None], tuple(table.inertia[rows].T[..., None]), p, R, w, v)]


def _set_members(result: Result, names: tuple[str, ...]) -> list[_Bodies]:
    """Members of sets of bodies."""
    out = []
    for name in names:
        if (found := result.set_of_bodies(name)) is not None:
            own, k = found
            out.append(_of_set(own, slice(None) if k is None else slice(k, k + 1)))
    return out


def _of_set(own: BodySetMotion, rows: slice) -> _Bodies:
    p, w, v = (tuple(a[:, rows].T) for a in (own.position, own.angular_velocity, own.velocity))
    inertia = tuple(own.inertia[rows].reshape(-1, 9).T[..., None])
    return _Bodies(own.mass[rows, None], inertia, p, tuple(x[:, rows].T for x in own.rotation), w, v)


def _mass_centre(groups: list[_Bodies], n: int) -> tuple[np.ndarray, ...]:
    mass = sum(float(g.mass.sum()) for g in groups)
    if mass == 0.0:
        return (np.full(n, np.nan),) * 3
    return tuple(sum((g.mass * g.p[c]).sum(axis=0) for g in groups) / mass for c in range(3))


def _point(result: Result, about: Any, centre: tuple) -> tuple[tuple, str]:
    """Position over time of the point of the angular momentum, and its name."""
    if about == MASS_CENTRE:
        return centre, "the common mass centre"
    if isinstance(about, str):
        if about not in result.model.by_name or not isinstance(result.model[about], (Body, Frame)):
            known = [MASS_CENTRE, *(b.name for b in result.model.bodies), *(f.name for f in result.model.frames)]
            raise ModelError(f"momentum: about={about!r} is no body or frame{suggest(about, known)}; {listing(known)}")
        return result.motions.named(about)[0], f"the origin of {about!r}"
    axes = 2 if result.planar else 3
    if np.ndim(about) != 1 or len(about) != axes:
        raise ModelError(
            f"momentum: about must be {axes} coordinates, a body, a frame or {MASS_CENTRE!r}, not {about!r}"
        )
    x = [number(v, {}, "m", "momentum: about") for v in about]
    position = (*x, *[0.0] * (3 - axes))
    return tuple(v + result.motions.zeros() for v in position), f"({', '.join(f'{v:g}' for v in x)}) m"
