"""Parameters that have another value from an instant on: the tables are filled in again, the pattern stays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ....equations.kinematics import ground_frames
from ....errors import FlyballError, SimulationError
from ....tables.numbers import words
from ....tables.system import G_VALUE, LOWER, NU, SPARE, SWITCH_LOWER, SWITCH_UPPER, UPPER
from ....tables.values import Values, values
from .here import Here

NEAR = 1e-9  # of the mechanism's length, or of a radian: what may be elsewhere by rounding


def set_parameters(here: Here, new: Mapping[str, float], who: str) -> None:
    """Go on with other values of parameters.

    Parameters
    ----------
    here : Here
    new : mapping
        Parameter -> value in SI units.
    who : str
        What asks for it, for messages.

    Raises
    ------
    SimulationError
        If a number makes no sense with them, or something would be elsewhere in no time.
    """
    c = here.c
    told = {**c.parameters, **new}
    old = c.values
    try:
        env = here.structure.model.environment(told)
        for e in here.structure.model.elements():
            if not set(words(e)).isdisjoint(_changed(old.env, env)):
                here.structure.model.validate(e, env)
        found = values(here.structure, told)
    except FlyballError as error:
        raise SimulationError(f"at t = {here.t:.9g} s {who}: {error}", t=here.t) from None
    before = _places(here, old)
    c.values, c.system, c.parameters = found, found.system, told
    ground_frames(c.system, c.work)
    _refuse_moved(here, who, before, _places(here, found))
    for row, column in ((LOWER, SWITCH_LOWER), (UPPER, SWITCH_UPPER)):
        moved = (old.system.switch_x[:, column] != found.system.switch_x[:, column]) & (c.work.switch[SPARE] == 0.0)
        c.work.switch[row, moved] = found.system.switch_x[moved, column]
    here.fresh = True


def _changed(old: Mapping[str, float], new: Mapping[str, float]) -> set[str]:
    return {k for k, x in new.items() if old[k] != x}


class Places(NamedTuple):
    """Where every body's reference frame is at the state of the motion and how it moves; what rows and drivers say."""

    at: dict[str, np.ndarray]
    moving: dict[str, np.ndarray]
    value: np.ndarray
    rate: np.ndarray


def _places(here: Here, x: Values) -> Places:
    """At the state of the motion, by these numbers."""
    c, s = here.c, here.structure
    here.evaluate()
    K, out, moving = c.work.BK, {}, {}
    for name, b in s.place.items():
        if b >= 0:
            R = K[b, 3:12].reshape(3, 3)
            out[name] = np.r_[K[b, :3] - R @ x.bodies[name].com, R.ravel(), K[b, :3]]
            moving[name] = K[b, 12:18].copy()
    return Places(out, moving, c.work.row[G_VALUE].copy(), c.work.row[NU].copy())


def _refuse_moved(here: Here, who: str, before: Places, after: Places) -> None:
    """Refuse that a body, or what a row holds, is elsewhere all at once, or that drivers ask for other speeds."""
    size = here.c.values.length
    titles = [f"{r.element.title} ({r.label})" for r in here.structure.rows]
    fast = {f"body {k!r}": np.abs(p - before.moving[k]).max() for k, p in after.moving.items()}
    fast |= {title: abs(a - b) for title, a, b in zip(titles, after.rate, before.rate, strict=True)}
    quick = max([1e-3 * size, *(np.abs(x).max() for x in before.moving.values())])
    off = {f"body {k!r}": np.abs(p - before.at[k]).max() / size for k, p in after.at.items()}
    off |= {title: abs(a - b) / size for title, a, b in zip(titles, after.value, before.value, strict=True)}
    worst = max(off, key=lambda name: off[name] if np.isfinite(off[name]) else np.inf)
    if not off[worst] <= NEAR:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would put {worst} elsewhere in no time, by {off[worst] * size:.3g}: a "
            f"parameter that is set may change forces, laws and masses, not where things are. Let a Driver move it",
            t=here.t,
        )
    worst = max(fast, key=lambda name: fast[name] if np.isfinite(fast[name]) else np.inf)
    if not fast[worst] <= NEAR * quick:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would change the velocity of {worst} by {fast[worst]:.3g} in no time, since "
            f"a driver's law jumps: let the law rise smoothly, as by step(t, ...)",
            t=here.t,
        )
