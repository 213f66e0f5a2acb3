"""What analyses answer for a mechanism that is written in other units, converted to the units before scaling."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

import flyball as fb
from flyball.simulation.simulate import state_units

from .scaling import Scale

UNDERFLOW = 1e-290  # smaller numbers are equal: near the smallest ones that there are, digits are lost
TIMES = np.linspace(0.0, 0.2, 5)  # of driven motions [s]
SWING, RANGE = 0.1, 0.3  # amplitude of driven motions, range of singularities [rad] or [m]
FACTOR = "factor"  # parameter, a number, of sensitivities
Answers = dict[str, Any]


def curves(run: fb.Result | fb.InverseDynamics, s: Scale) -> Answers:
    """All curves of a result."""
    out: Answers = {}
    for name, (unit, values) in run.channels().items():
        try:
            curve = np.asarray(values) / s.of(unit)
        except KeyError:
            continue
        out[name] = np.where(np.abs(curve) < UNDERFLOW, 0.0, curve)
    return out


def numbers(run: fb.Result | fb.InverseDynamics, s: Scale) -> Answers:
    """All numbers of a result by unit: what is zero but for rounding is compared with the others.

    Torques are divided by the mechanism's length and compared with the forces.
    """
    found, out = curves(run, s), {}
    result = run if isinstance(run, fb.Result) else run.result
    length = result.values.length / s.length
    for name, (unit, _) in run.channels().items():
        if name in found:
            torque = unit == "N*m"
            out.setdefault("N" if torque else unit, []).append(found[name] / length if torque else found[name])
    return {unit: np.stack(x, axis=-1) for unit, x in out.items()}


def assembly(m: fb.Mechanism, s: Scale) -> Answers:
    """Position and velocity, relative to the mechanism's length."""
    a = m.assemble()
    units, nq = state_units(a.compiled, len(a.y)), len(a.q)
    return {"q": a.q / units[:nq], "v": a.v / units[nq : nq + len(a.v)] * s.time, "iterations": a.iterations}


def mobility(m: fb.Mechanism, s: Scale) -> Answers:
    """Numbers of freedoms and redundant rows, their names, and free motions."""
    x = m.mobility()
    out: Answers = {k: getattr(x, k) for k in ("freedoms", "rank", "rows", "redundant", "undetermined")}
    out["geometry"] = [getattr(x.geometry, k) for k in ("here", "nearby", "generic")] if x.geometry else None
    out["sets"] = [(y.elements, y.count, y.contradiction, y.here_only) for y in x.sets]
    units = m.assemble().compiled.values.system.velocity_units
    for k, free in enumerate(x.motions):
        # a description of a motion contains numbers
        out[f"motion {k}"] = (free.coordinate, free.bodies)
        out[f"velocity {k}"] = free.velocity / units / np.abs(free.velocity / units).max()
    return out


def equilibrium(m: fb.Mechanism, s: Scale) -> Answers:
    """State at rest and its stability."""
    x = m.equilibrium()
    return numbers(x.result, s) | {"stability": x.stability, "touching": [t.state for t in x.touching]}


def linear(m: fb.Mechanism, s: Scale) -> Answers:
    """Matrix of the linear equations, and the state about which they are."""
    x = m.linearize(frozen=True)
    size = np.array([s.of(unit) for unit in x.state_units])
    rate = 1.0 if x.period is not None else s.time
    return numbers(x.point, s) | {"A": x.A * rate / size[:, None] * size, "turning": x.turning * s.time}


def modes(m: fb.Mechanism, s: Scale) -> Answers:
    """Eigenvalues; shapes of equal eigenvalues are not unique."""
    x = m.modes(frozen=True)
    return {
        "eigenvalues": x.eigenvalues * s.time,
        "multiplicity": x.multiplicity,
        "fastest": np.array(x.fastest * s.time),
    }


def _freedoms(m: fb.Mechanism, s: Scale) -> dict[str, float]:
    """Coordinates of the free motions and their values."""
    point = m.linearize(frozen=True).point.channels()
    names = [x.coordinate for x in m.mobility().motions]
    return {name: float(point[name][1][0]) for name in names if name in point}


def kinematics(m: fb.Mechanism, s: Scale) -> Answers:
    """Motion of the mechanism where its drivers leave no freedom."""
    return numbers(m.kinematics(TIMES * s.time, progress=False, specialize=False), s)


def inverse_dynamics(m: fb.Mechanism, s: Scale) -> Answers:
    """Efforts and reactions while all freedoms swing."""
    laws = {
        name: f"{value!r} + {SWING * s.coordinate(name)!r}*(1 - cos(t/{s.time!r}))"
        for name, value in _freedoms(m, s).items()
    }
    return numbers(m.inverse_dynamics(TIMES * s.time, laws, progress=False, specialize=False), s)


def singularities(m: fb.Mechanism, s: Scale) -> Answers:
    """Singular positions of a mechanism of one freedom about its position."""
    drivers = [(e.name, e.coordinate) for e in m.elements() if isinstance(e, fb.Driver)]
    for name, value in _freedoms(m, s).items() if not drivers else ():
        drivers.append(("sweep", name))
        m.add(fb.Driver("sweep", name, law=value))
    if not drivers:
        return {"error": "no freedom is a coordinate"}
    name, coordinate = drivers[0]
    middle = float(m.linearize(frozen=True).point.channels()[coordinate][1][0])
    unit = s.coordinate(coordinate)
    x = m.singularities(name, (middle - RANGE * unit, middle + RANGE * unit))
    out: Answers = {"s": x.s, "a": x.a / unit, "distance": x.distance, "ends": len(x.ends)}
    out |= {k: v / s.coordinate(k) for k, v in x.values.items()}
    out["points"] = [(p.kind, p.lost, p.branch_point, len(p.branches), len(p.motions)) for p in x.points]
    out["places"] = np.array([p.a for p in x.points]) / unit
    return out


def _with_factor(m: fb.Mechanism) -> fb.Mechanism:
    """The mechanism with a parameter that multiplies gravity and the mass of the first body."""
    gravity = tuple(f"({g!r})*{FACTOR}" if g else g for g in m.gravity)
    out = fb.Mechanism(m.name, planar=m.planar, gravity=gravity, parameters={FACTOR: 1.0})
    body = m.bodies[0]
    out.add(*(dataclasses.replace(e, mass=f"({e.mass!r})*{FACTOR}") if e is body else e for e in m.elements()))
    return out


def _sensitivity(analysis: str) -> Callable[[fb.Mechanism, Scale], Answers]:
    def of(m: fb.Mechanism, s: Scale) -> Answers:
        """Derivatives with respect to a factor of gravity and of a mass."""
        m, body = _with_factor(m), m.bodies[0].name
        what = [f"{body}.{k}" for k in ("x", "vx", "ax")] + [f"{j.name}.fx" for j in m.joints[:2]]
        what = [] if analysis == "modes" else what[:1] if analysis == "equilibrium" else what
        x = m.sensitivity(what, analysis=analysis)
        size = np.array([s.of(unit) for unit in x.units])
        out = {"values": x.values / size, "derivatives": x.derivatives[..., 0] / size}
        if analysis == "equilibrium":  # one place, which may be zero but for rounding
            length = m.assemble().compiled.values.length / s.length
            out = {k: np.append(values, length) for k, values in out.items()}
        return out

    return of


ANALYSES: dict[str, Callable[[fb.Mechanism, Scale], Answers]] = {
    "assemble": assembly, "mobility": mobility, "equilibrium": equilibrium, "linearize": linear, "modes": modes,
    "kinematics": kinematics, "inverse_dynamics": inverse_dynamics, "singularities": singularities,
    **{f"sensitivity {x}": _sensitivity(x) for x in ("instant", "equilibrium", "modes")},
}  # fmt: skip


def asked(analysis: str, m: fb.Mechanism, s: Scale) -> Answers:
    """Answers of an analysis; or the type of its error."""
    try:
        return ANALYSES[analysis](m, s)
    except fb.FlyballError as error:
        return {"error": type(error).__name__}
