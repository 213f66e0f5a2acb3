"""Motion with contact: the scene in arrays, the steps, and what comes of them."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

import numpy as np

from ....errors import AnalysisError, SimulationError
from ....model.model import Model
from ....results.result import Result
from ....results.sides import Sides
from ....stepping.stepper import NoWay, Stepper
from ....stepping.tables import TIME
from ....tables.contact import Touching, touching
from ....tables.coordinates import BodyState
from ...assembly.described import described
from ...assembly.start import Assembly
from ...compiled import Compiled, compiled
from ...progress import Tell
from ..part import KEPT, Part, whole
from .collect import Collected
from .ending import INTERRUPTED, REACHED, result_of
from .going_on import base_of, counted, place_sets
from .held import acting_values, held_apart
from .parts import parts
from .scene import begin, movers, placed
from .settings import Stepping

NO_WAY = (
    "a force or a law gives no finite number, the equations have no solution, or joints cannot be closed: give shorter "
    "steps, method=fb.Stepping(step=...)"
)
EACH, SLICE = 1000, 1.0  # steps after which it is told how far it is, and seconds that they take at most


def impulse_motion(
    model: Model,
    span: tuple[float, float],
    times: np.ndarray,
    o: Stepping,
    parameters: Mapping[str, float] | None,
    tell: Tell,
    before: Result | None = None,
    part: Part | None = None,
) -> Result:
    """The motion by steps of impulses over a span of time; see `Mechanism.simulate`.

    Raises
    ------
    ModelError
        If the scene makes no sense.
    SimulationError
        If the steps cannot go on.
    """
    since, part = time.perf_counter(), part or whole()
    model = model.snapshot()
    plain = compiled(model, parameters=parameters)
    values = plain.values
    found = parts(model, acting_values(model, values, parameters))
    scene = touching(model, values.given, (*found.free, *found.held))
    free = len(scene.carriers.mass) - len(found.held)
    drawn = as_drawn(plain, span[0]) if before is None else None
    base = drawn or base_of(model, span[0], parameters, before)
    held = held_apart(values, span[0], parameters, found, free, base if before is not None else None)
    at = movers(scene, moving(drawn)) if drawn else placed(scene, base)
    if before is not None:
        place_sets(scene, at, before)
    try:
        stepper = begin(scene, at, values, o, held)
    except NoWay:
        raise AnalysisError(f"{model.name!r} cannot start: {NO_WAY}") from None
    names = [*scene.carriers.names, "ground"]
    counts = [-1 if n in scene.carriers.single or n == "ground" else _size(scene, n) for n in names]
    sides = Sides(names, counts)
    kept = Collected(stepper, held, np.arange(len(scene.carriers.mass) + 1))
    part.begin_by_impulses(len(scene.carriers.mass))
    try:
        interrupted = march(stepper, span, times, o, kept, tell, part)
    except NoWay:
        result = counted(result_of(base, scene, stepper, kept, sides, o, since, ""), before, part)
        t = float(stepper.pace.real[TIME])
        result.health.message = f"{model.name!r} cannot go on at t = {t:.6g} s: {NO_WAY}"
        raise SimulationError(result.health.message, result, t) from None
    message = INTERRUPTED if interrupted else KEPT if part.paused else REACHED
    message = message.format(float(stepper.pace.real[TIME]))
    return counted(result_of(base, scene, stepper, kept, sides, o, since, message), before, part)


def _size(scene: Touching, name: str) -> int:
    at = scene.carriers.slices[name]
    return at.stop - at.start


def march(
    stepper: Stepper,
    span: tuple[float, float],
    times: np.ndarray,
    o: Stepping,
    kept: Collected,
    tell: Tell,
    part: Part,
) -> bool:
    """Steps that end at the output times, as equal as these allow. Returns whether the user interrupted.

    Where the part ends there is a row of output in any case.
    """
    first, last = span
    real, each = stepper.pace.real, 1
    real[TIME] = first
    if len(times) and times[0] == first:
        kept.add(False)
    try:
        for t in (*times[times > first].tolist(), last):
            way = t - float(real[TIME])
            steps = math.ceil(way / o.longest * (1.0 - 1e-9) - 1e-12)
            if steps > 0:
                stepper.run(1, way / steps)
                if kept.t and not kept.acceleration:
                    kept.first()
                part.took(1)
                left = steps - 1
                while left and not part.over():
                    n, began = part.most(min(each, left)), time.perf_counter()
                    stepper.run(n, way / steps)
                    part.took(n)
                    each = max(1, min(EACH, int(n * SLICE / max(time.perf_counter() - began, 1e-9))))
                    left -= n
                    tell((float(real[TIME]) - first) / (last - first))
                if left:
                    kept.add(True)
                    return False
            real[TIME] = t
            if len(kept.t) < len(times):
                kept.add(True)
            tell((t - first) / (last - first))
            if t < last and part.over():
                if kept.t[-1] < t:
                    kept.add(True)
                return False
    except KeyboardInterrupt:
        return True
    return False


# A start of bodies on which nothing acts: as drawn and told, without the engine, which need not be compiled then.


def as_drawn(c: Compiled, t: float) -> Assembly | None:
    """The assembled start if there is nothing to assemble; None otherwise."""
    s, model = c.structure, c.structure.model
    if s.rows or s.terms or s.states or len(s.forces) or model.initial:
        return None
    q = c.values.q.copy()
    return Assembly(c, t, q, described(c.values, q))


def moving(base: Assembly) -> dict[str, BodyState]:
    """How every body moves at that start."""
    values, out = base.compiled.values, {}
    tree = values.structure.tables["tree"]
    for name, b in values.structure.place.items():
        if b >= 0:
            d = values.bodies[name]
            u = base.v[tree.velocities(b)]
            if values.structure.model.planar:
                v, w = np.r_[u[:2], 0.0], np.r_[0.0, 0.0, u[2:] if len(u) > 2 else 0.0]
            else:
                v, w = u[:3], d.R @ u[3:] if len(u) > 3 else np.zeros(3)
            out[name] = BodyState(d.c, d.R, v, w, d.angle)
    return out
