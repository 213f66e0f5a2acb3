"""Run a mechanism and say how it ended; anything but health or a clear refusal is a failure."""

from __future__ import annotations

import re
import time
import warnings
from dataclasses import dataclass

import numpy as np

import flyball as fb
from flyball.results.energy_balance import energy_moved
from flyball.results.result import Result

from .bounds import against
from .families import Case
from .holding import misheld

STEPS = 3000
OUTPUTS = 21
VIOLATION, UNBALANCED, RESIDUAL = 1e-7, 1e-4, 1e-6
TIGHTER, LESS = 1e-2, 0.1  # times its tolerance a motion is computed again where energy is off, which then is less


@dataclass
class Verdict:
    """How it ended: "healthy", the name of the error that refused it, or "broken" with what is wrong."""

    kind: str
    text: str = ""
    violation: float = 0.0  # relative to the mechanism's length
    energy: float = 0.0  # relative to the energy moved
    residual: float = 0.0  # of G vdot = gamma, relative to its terms
    seconds: float = 0.0


def judge(case: Case) -> Verdict:
    """Simulate a case within a bounded number of steps, and look hard at what comes out."""
    begin = time.process_time()
    verdict = _judged(case)
    verdict.seconds = time.process_time() - begin
    for text in case.refused:
        if not _clear(text, case.mechanism):
            return Verdict("broken", f"unclear refusal: {text}")
    return verdict


def _judged(case: Case) -> Verdict:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # NumPy's: they tell of numbers that are none
        try:
            result = case.mechanism.simulate(case.t_end, **{"outputs": OUTPUTS, "max_steps": STEPS} | case.options)
        except fb.SimulationError as error:
            problem = _partial(error)
            return Verdict("broken", problem) if problem else _refused(error, case)
        except fb.FlyballError as error:
            return _refused(error, case)
        except Exception as error:
            return Verdict("broken", f"raised {type(error).__name__}: {error}")
        try:
            return _healthy(result, case)
        except Exception as error:
            return Verdict("broken", f"the result raises {type(error).__name__}: {error}")


def _of_tolerance(case: Case, energy: float) -> bool:
    """Whether energy is off by what the tolerance allows: it is off by much less at a tighter one."""
    loose = case.options.get("rtol", 0.0)
    if not loose > UNBALANCED * TIGHTER:
        return False
    tight = {"rtol": TIGHTER * loose, "atol": TIGHTER * case.options.get("atol", loose)}
    r = case.mechanism.simulate(case.t_end, **{"outputs": OUTPUTS, "max_steps": STEPS} | case.options | tight)
    return bool(r.energy.drift <= LESS * min(energy, UNBALANCED) * energy_moved(r))


def _refused(error: Exception, case: Case) -> Verdict:
    text = str(error)
    if not _clear(text, case.mechanism):
        return Verdict("broken", f"unclear {type(error).__name__}: {text}")
    return Verdict(type(error).__name__, text)


def _clear(text: str, m: fb.Mechanism) -> bool:
    """Names an element and is a sentence."""
    named = re.search(r"[A-Z]\w+ '[^']+'", text) or any(e.name in text for e in m.elements())
    return len(text) > 30 and bool(named)


def _partial(error: fb.SimulationError) -> str:
    r = error.result
    if not isinstance(r, Result) or not np.isfinite(error.t):
        return "a SimulationError without result or time"
    if not all(np.isfinite(x).all() for x in (r.t, r.q, r.v, r.vdot, r.multipliers, r.states)):
        return "a partial result that is not finite"
    return ""


def _healthy(r: Result, case: Case) -> Verdict:
    for name, (_, values) in r.channels().items():
        if not np.isfinite(values).all():
            return Verdict("broken", f"{name} is not finite")
    if not all(np.isfinite(x).all() for x in (r.q, r.v, r.vdot, r.multipliers, r.states)):
        return Verdict("broken", "the result is not finite")
    str(r.health)
    if wrong := against(r) or misheld(r, case.mechanism):
        return Verdict("broken", wrong)
    lost = r.exchanged.get("impact_loss", np.zeros(1))
    if np.diff(lost, prepend=0.0).min(initial=0.0) < -1e-9 * (1.0 + np.abs(lost).max(initial=0.0)):
        return Verdict("broken", f"an impact gives energy: {np.diff(lost, prepend=0.0).min():.3g} J")
    moved = energy_moved(r)
    energy = r.energy.drift / moved if moved > 0.0 else 0.0
    for f in case.mechanism.forces:
        if f.single == "friction" and np.diff(r[f.name].work).max(initial=0.0) > 1e-6 * (1e-6 + moved):
            return Verdict("broken", f"{f.title} gives {np.diff(r[f.name].work).max():.3g} J")
    out = Verdict("healthy", "", r.health.violation / r.values.length, energy, r.health.acceleration_violation)
    if out.violation > VIOLATION and case.options.get("stabilization") != "baumgarte":
        return Verdict("broken", f"violation {out.violation:.2e}", out.violation, energy, out.residual)
    if out.residual > RESIDUAL:
        told = any("accelerations violate" in w for w in r.health.warnings)
        kind = "warned" if told else "broken"
        return Verdict(kind, f"G vdot - gamma {out.residual:.2e}", out.violation, energy, out.residual)
    if r.energy.drift > UNBALANCED * moved + 1e-9 * (1.0 + np.abs(r.energy.potential).max()):
        if _of_tolerance(case, energy):
            return out
        told = any("energy balance" in w for w in r.health.warnings)
        kind = "warned" if told else "broken"
        return Verdict(kind, f"energy off by {energy:.2e} of what moved", out.violation, energy, out.residual)
    if moved < 1e-6:
        out.energy = 0.0  # a structure: nothing moves that could be compared with
    return out
