"""A verdict on one case: it agrees, is refused by name, is warned of, or is wrong in silence."""

from __future__ import annotations

import random
import time
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from tests.robust.families import Case
from tests.robust.verdict import judge as by_health

import flyball as fb

from . import content, physics, relations, scenes, touching
from .physics import Finding

KINDS = ("agrees", "refused", "warned", "uneven", "wrong")
ALL = {**content.FAMILIES, **scenes.SCENES}
FOR_CONTACT = ("coordinates", "units", "axes", "names", "order", "halves", "parameters", "file")
OUTPUTS = 41
OF_ANGLES = ("energy by formula", "law of a force")  # judges that count turns between outputs
TURNED, CLOSEST = 1.0, 4000  # rad between two outputs at most, and at most so many outputs, where turns are counted


@dataclass
class Verdict:
    """How a case ended, with what is said of it and the outcome of each relation."""

    family: str
    seed: int
    kind: str
    findings: list[Finding] = field(default_factory=list)
    outcomes: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0


def made(family: str, seed: int) -> Case:
    """The case of a family and a seed."""
    return scenes.made(family, seed) if family in scenes.SCENES else content.made(family, seed)


def judged(family: str, seed: int, count: int, only: list[str] | None = None) -> Verdict:
    """One case with some of the relations, chosen by its seed (all where ``count`` is not less)."""
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        verdict = _judged(family, seed, count, only)
    verdict.seconds = time.process_time() - begin
    return verdict


def _judged(family: str, seed: int, count: int, only: list[str] | None) -> Verdict:
    scene = family in scenes.SCENES
    try:
        case = made(family, seed)
        b = relations.base(case.mechanism, case.t_end, _options(case), _outputs(case))
    except fb.FlyballError as error:
        return Verdict(family, seed, "refused", [Finding("base", str(error)[:200], np.nan, 0.0)])
    except Exception as error:
        return Verdict(
            family, seed, "wrong", [Finding("base", f"raised {type(error).__name__}: {error}"[:300], np.nan, 0.0)]
        )
    uneven: list[Finding] = []
    try:
        found = touching.findings(b.run, b.mechanism, family) if scene else physics.findings(b.run, b.mechanism)
        if any(f.relation == "derivative" for f in found):
            found = [f for f in found if f.relation != "derivative"] + _closer(b)
        if not scene and any(f.relation in OF_ANGLES for f in found):
            found = [f for f in found if f.relation not in OF_ANGLES] + _counted(b)
    except fb.FlyballError as error:  # a motion with more outputs is refused by name, as one by another method may be
        found, uneven = [], [Finding("judges", f"{type(error).__name__}: {error}"[:300], np.nan, 0.0)]
    except Exception as error:
        found = [Finding("judges", f"raised {type(error).__name__}: {error}"[:300], np.nan, 0.0)]
    if family in content.KNOWN and count:
        health = by_health(case)
        if health.kind == "broken":
            found.append(Finding("health", health.text[:300], np.nan, 0.0))
    names = list(FOR_CONTACT) if scene else list(relations.RELATIONS)
    chosen = only or random.Random(f"{family} {seed}").sample(names, min(count, len(names)))
    outcomes = {}
    for name, outcome, finding in relations.compared(b, chosen, seed):
        outcomes[name] = outcome
        if outcome in ("differs", "raised"):
            found.append(finding)
        elif outcome == "refused":
            uneven.append(finding)
    doubt = relations.doubts(b.run)
    if found:
        kind = "warned" if doubt else "wrong"
    else:
        kind = "uneven" if uneven else "warned" if doubt or "warned" in outcomes.values() else "agrees"
    return Verdict(family, seed, kind, [*found, *uneven], outcomes)


def _closer(b: relations.Base) -> list[Finding]:
    """Rates once more, by outputs that lie closer."""
    times = np.linspace(b.run.t[0], b.run.t[-1], 40 * len(b.run.t))
    run = relations.simulated(b.mechanism, b.t_end, times, b.options)
    return list(physics.derivatives(physics.Motion(run, b.mechanism)))


def _counted(b: relations.Base) -> list[Finding]:
    """What is said of angles once more, by outputs between which no body turns far by its speed and acceleration."""
    run, times = b.run, b.times
    while True:
        h, far = np.diff(run.t), np.zeros(len(run.t) - 1)
        for body in b.mechanism.bodies:
            w, a = (
                np.linalg.norm(np.asarray(x).reshape(len(run.t), -1), axis=1)
                for x in (run[body.name].angular_velocity, run[body.name].angular_acceleration)
            )
            far = np.maximum(far, np.maximum(w[1:], w[:-1]) * h + 0.5 * np.maximum(a[1:], a[:-1]) * h**2)
        wide = np.flatnonzero(far > TURNED)
        if not len(wide) or len(times) + len(wide) > CLOSEST:
            break
        times = np.sort(np.r_[times, 0.5 * (run.t[wide] + run.t[wide + 1])])
        run = relations.simulated(b.mechanism, b.t_end, times, b.options)
    return [f for f in physics.findings(run, b.mechanism) if f.relation in OF_ANGLES]


def _options(case: Case) -> dict[str, Any]:
    """What the case asks for, but for tolerances and outputs of its own."""
    options = {k: v for k, v in case.options.items() if k not in ("rtol", "atol", "outputs", "max_steps")}
    return options


def _outputs(case: Case) -> int:
    """Where it is stepped by impulses every step is an output."""
    method = case.options.get("method")
    return round(case.t_end / method.step) + 1 if isinstance(method, fb.Stepping) else OUTPUTS
