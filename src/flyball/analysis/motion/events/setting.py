"""Parameters that have another value from an instant on: the tables are filled in again, the pattern stays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ....constraints.modes import ELASTIC, RATCHET, STOP
from ....equations.kinematics import ground_frames
from ....errors import FlyballError, SimulationError
from ....model.touch import Touch
from ....tables.contact.places import places
from ....tables.numbers import words
from ....tables.system import VALUE, assign, changed
from ....tables.values import Values, values
from .bounds import beyond, rule, sizes, units
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
    _refuse_other_places(here, found, who)
    before, bounds, kept = _places(here, old), changed(lambda _, x: x.copy(), c.work.modes), c.parameters
    _take(here, found, told)
    try:
        _refuse_moved(here, who, before, _places(here, found))
        _move_bounds(here, old)
        _refuse_beyond(here, who)
    except SimulationError:
        _take(here, old, kept)
        assign(c.work.modes, bounds)
        raise
    here.fresh = True


def _take(here: Here, x: Values, told: Mapping[str, float]) -> None:
    """Go on by these numbers."""
    c = here.c
    c.values, c.system, c.parameters = x, x.system, dict(told)
    ground_frames(c.system, c.work)


def _move_bounds(here: Here, old: Values) -> None:
    """Bounds of stops, and teeth, as the numbers now say."""
    S, W = here.c.system, here.c.work
    now, then = S.switch_numbers, old.system.switch_numbers
    moved = (now.lower != then.lower) | (now.upper != then.upper)
    for s in np.flatnonzero((W.modes.released == 0.0) & moved).tolist():
        if S.switches.kind[s] in (STOP, ELASTIC, RATCHET):
            W.modes.lower[s], W.modes.upper[s] = now.lower[s], now.upper[s]


def _refuse_other_places(here: Here, new: Values, who: str) -> None:
    """Refuse that shapes that may touch are others: their places are laid out when a motion begins."""
    model, had = here.structure.model, [e for e in here.structure.model.forces if isinstance(e, Touch)]
    if not had:
        return
    has = places(model, new.given).touches
    moved = np.array([_apart(a, b) for a, b in zip(had, has, strict=False)] if len(had) == len(has) else [np.inf])
    if not moved.max() <= NEAR * here.c.values.length:
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would put what touches at {had[int(moved.argmax())].title} elsewhere in no "
            f"time, by {moved.max():.3g} m: shapes of contacts keep their sizes and places while they move",
            t=here.t,
        )
    for a, b in zip(had, has, strict=True):
        if (a.friction, a.restitution) != (b.friction, b.restitution):
            raise SimulationError(
                f"at t = {here.t:.9g} s {who} would change friction or restitution of {a.title}, which a motion that "
                f"is integrated takes as they are at its start; let one motion end there (fb.Stop), and go on from it "
                f"with the other value: simulate(start=run, parameters=...)",
                t=here.t,
            )


def _apart(a: Touch, b: Touch) -> float:
    """How far the numbers of two places are apart."""
    pairs = [(a.gap, b.gap), *zip(a.slips, b.slips, strict=False), *zip(a.frames, b.frames, strict=True)]
    return max((abs(x - y) for one, other in pairs for x, y in zip(one, other, strict=True)), default=0.0)


def _refuse_beyond(here: Here, who: str) -> None:
    """Refuse that a stop, a rope or a tooth is where its quantity may not be."""
    s, W = here.structure, here.c.work
    past = beyond(here, NEAR * sizes(s, here.c.values.length))
    if past:
        k = max(past, key=past.__getitem__)
        spec, unit = s.switches[k], units(s)[k]
        bounds, x = (W.modes.lower[k], W.modes.upper[k]), W.sensed[VALUE, spec.measured]
        said = "it is held where no tooth is" if spec.switch.kind == RATCHET else rule(spec, float(x), bounds, unit)
        raise SimulationError(
            f"at t = {here.t:.9g} s {who} would put {spec.element.title} elsewhere in no time, by {past[k]:.3g} "
            f"{unit}: {said}. Set it where nothing is beyond it, give it stiffness=..., or let a Driver move what it "
            f"is fixed to",
            t=here.t,
        )


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
    return Places(out, moving, c.work.rows.value.copy(), c.work.rows.nu.copy())


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
