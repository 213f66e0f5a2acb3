"""The same motion by other ways: `RELATIONS`."""

from __future__ import annotations

import copy
import dataclasses
import os
import random
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import flyball as fb

from . import changes
from .gaps import JOINTS, _common
from .physics import Finding
from .poses import matrix, spatial
from .scaling import Scale, Unsupported, scaled

RTOL, ATOL = 1e-9, 1e-11
NUDGE = 1e-7  # relative change of masses, gravity and speeds by which the motion's sensitivity is measured
GROWTH = 1e3  # beyond this growth of a change nothing is compared: 1e-12 would come to 1e-9
AGREE = 3e-6  # of the motion's size, times the growth: what runs at RTOL may differ by
AGREE_STEPS = 1e-4  # of motions by impulses, whose solver stops at a residual
STEPS = 20_000
SLOW = 0.1  # of its reach, or of a radian, over the whole motion: speeds are compared with no less
HOLD = 1e-12  # of the mechanism's reach, or its speed: joints' points are held together to
NONE = 1e-14  # of the largest singular value: one that is none
TIGHT = {"rtol": 1e-2 * RTOL, "atol": 1e-2 * ATOL, "max_steps": 10 * STEPS}  # of a run that tells what tolerances do
MARGIN = 10.0  # times what that differs by: other ways may
COARSE, COARSER = 1e-6, 1e3  # a common relative tolerance, and how much more a run at it may differ by

Simulated = Callable[..., fb.Result]


@dataclass
class Base:
    """A motion, and how much a change of its start has grown by each output time."""

    mechanism: fb.Mechanism
    run: fb.Result
    t_end: float
    options: dict[str, Any]
    growth: np.ndarray
    times: np.ndarray  # outputs that were asked for

    @property
    def horizon(self) -> int:
        """Number of output times up to which motions are compared."""
        beyond = np.flatnonzero(self.growth > GROWTH)
        return int(beyond[0]) if len(beyond) else len(self.growth)


def doubts(run: Any) -> list[str]:
    """What a result says against itself; that given velocities are not possible says nothing against the motion."""
    warned = getattr(getattr(run, "health", None), "warnings", ())
    return [w for w in warned if "the nearest possible velocity is used" not in w]


def simulated(m: fb.Mechanism, t_end: float, times: Any, options: dict[str, Any], **other: Any) -> fb.Result:
    """A run with the harness's tolerances."""
    every = {"rtol": RTOL, "atol": ATOL, "max_steps": STEPS, "progress": False} | options | other
    if isinstance(every.get("method"), fb.Stepping):
        every = {k: v for k, v in every.items() if k not in ("rtol", "atol", "max_steps")}
    return m.simulate(t_end, outputs=times, **every)


def state(run: fb.Result, m: fb.Mechanism) -> dict[str, np.ndarray]:
    """Positions, rotations and velocities of all bodies over time."""
    out = {}
    for b in m.bodies:
        r = run[b.name]
        n = len(run.t)
        out[f"{b.name} position"] = np.asarray(r.position).reshape(n, -1)
        out[f"{b.name} rotation"] = np.asarray(r.rotation).reshape(n, -1)
        out[f"{b.name} velocity"] = np.asarray(r.velocity).reshape(n, -1)
        out[f"{b.name} angular_velocity"] = np.asarray(r.angular_velocity).reshape(n, -1)
    return out


def sizes(now: dict[str, np.ndarray], t_end: float) -> dict[str, float]:
    """By which differences are measured: how far things move, how fast they are, a radian."""
    far = max((np.ptp(v, axis=0).max() for k, v in now.items() if k.endswith("position")), default=0.0)
    reach = max((np.abs(v).max() for k, v in now.items() if k.endswith("position")), default=0.0)
    fast = max((np.abs(v).max() for k, v in now.items() if k.endswith(" velocity")), default=0.0)
    turns = max((np.abs(v).max() for k, v in now.items() if k.endswith("angular_velocity")), default=0.0)
    slow = SLOW / t_end
    return {
        "position": far + 1e-3 * reach + 1e-9,
        "rotation": 1.0,
        "velocity": fast + slow * max(reach, 1e-6),
        "angular_velocity": turns + slow,
    }


def difference(a: dict[str, np.ndarray], b: dict[str, np.ndarray], size: dict[str, float]) -> tuple[np.ndarray, str]:
    """Largest relative difference at each time, and of what it is the largest."""
    worst, name, top = None, "", -1.0
    for k, v in a.items():
        d = np.abs(v - b[k]).max(axis=1) / size[k.split()[-1]]
        worst = d if worst is None else np.maximum(worst, d)
        if d.max() > top:
            top, name = d.max(), k
    return (np.zeros(1) if worst is None else worst), name


def nudged(m: fb.Mechanism) -> fb.Mechanism:
    """Masses, gravity and velocities changed by a ten-millionth."""
    dice = random.Random(1)

    def by(v: Any) -> Any:
        if isinstance(v, tuple):
            return tuple(by(c) for c in v)
        return v * (1.0 + NUDGE * dice.uniform(-1, 1)) if isinstance(v, float | int) else v

    def of(e: Any) -> Any:
        if not isinstance(e, fb.Body):
            return e
        own = changes.fields(e)
        for k in ("mass", "density", "velocity", "angular_velocity"):
            if own.get(k) is not None and not (k == "mass" and e.inertia is None and e.shape is None):
                own[k] = by(own[k])
        return type(e)(**own)

    return changes.again(m, of, gravity=by(tuple(m.gravity)))


def firmness(m: fb.Mechanism) -> float:
    """How firmly joints' points hold what they do not leave free, as drawn: the least singular value that is not none.

    Of the rates at which these points part, by velocities and by rates of turning about the bodies' origins over the
    mechanism's reach; relative to the largest.
    """
    joints = [e for e in m.joints if _common in JOINTS.get(type(e).__name__, ()) and np.ndim(e.at) == 1]
    number = {b.name: k for k, b in enumerate(m.bodies)}
    n, turns = (2, 1) if m.planar else (3, 3)
    reach = max((np.abs(np.asarray(e.at, float)).max() for e in joints), default=0.0) or 1.0
    J = np.zeros((n * len(joints), (n + turns) * len(number)))
    for k, e in enumerate(joints):
        for name, sign in ((e.body_i, -1.0), (e.body_j, 1.0)):
            if name not in number:
                continue
            x, y, z = spatial(np.subtract(e.at, m[name].position[:n])) / reach
            turning = np.array([[-y], [x]]) if m.planar else np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
            at = (n + turns) * number[name]
            J[n * k : n * k + n, at : at + n + turns] = sign * np.hstack([np.eye(n), turning])
    values = np.linalg.svd(J, compute_uv=False) if J.size else np.ones(1)
    return float(min(values[values > NONE * values.max()] / values.max(), default=1.0))


def own_error(b: Base, name: str, seed: int) -> np.ndarray:
    """By how much motions may differ that are not determined any closer, relative as in `difference`.

    That is anything where joints hold a structure that is all but free to move; else the difference that a tighter
    tolerance makes to the motion, and to that by the other way, if the same happens. It is asked for where motions
    differ.
    """
    if firmness(b.mechanism) < HOLD / AGREE:
        return np.full(len(b.run.t), np.inf)
    size, out = sizes(state(b.run, b.mechanism), b.t_end), np.zeros(len(b.run.t))
    ways: list[Callable[[Base], tuple]] = [lambda x: _again(x, x.mechanism)]
    if name != "halves":
        ways.append(lambda x: RELATIONS[name](x, random.Random(f"{name} {seed}")))
    for way in ways:
        runs, states = [], []
        for more in ({}, {k: v for k, v in TIGHT.items() if k not in b.options}):
            try:
                run, m, back = way(dataclasses.replace(b, options=b.options | more))
            except fb.FlyballError:
                break
            runs.append(run)
            states.append(back(state(run, m)) if back else state(run, m))
        whole = len(runs) == 2 and all(len(x.t) == len(out) for x in runs)
        if whole and not _happened(dataclasses.replace(b, run=runs[0]), runs[1], len(out)):
            out = np.maximum(out, np.maximum.accumulate(difference(*states, size)[0]))
    return MARGIN * out


def base(m: fb.Mechanism, t_end: float, options: dict[str, Any], outputs: int) -> Base:
    """The motion as it is described, and its sensitivity."""
    times = np.linspace(0.0, t_end, outputs)
    run = simulated(m, t_end, times, options)
    growth = np.full(len(run.t), np.inf)
    try:
        other = simulated(nudged(m), t_end, times, options)
        now = state(run, m)
        d, _ = difference(now, state(other, m), sizes(now, t_end))
        growth = np.full(len(run.t), np.inf)
        growth[: len(d)] = np.maximum.accumulate(d) / NUDGE
    except (fb.FlyballError, ValueError):
        pass
    return Base(m, run, t_end, options, growth, times)


Relation = Callable[[Base, random.Random], tuple[fb.Result, fb.Mechanism, Callable[[dict], dict] | None]]


def _again(b: Base, m: fb.Mechanism, back: Callable[[dict], dict] | None = None, **other: Any) -> tuple:
    return simulated(m, b.t_end, b.times, b.options, **other), m, back


def has_functions(m: fb.Mechanism) -> bool:
    """Whether any law is a Python function."""
    values = [v for e in m.elements() for v in changes.fields(e).values()]
    return any(callable(x) for v in values for x in (v if isinstance(v, tuple) else (v,)))


def other_coordinates(b: Base, dice: random.Random) -> tuple:
    if "coordinates" in b.options or isinstance(b.options.get("method"), fb.Stepping):
        raise Unsupported("coordinates are given")
    used = "joint" if str(b.run.health.coordinates).startswith("joint") else "absolute"
    try:
        return _again(b, b.mechanism, coordinates="absolute" if used == "joint" else "joint")
    except fb.AnalysisError as error:
        if "has no motion of its own in joint coordinates" not in str(error):
            raise
        raise Unsupported("friction follows reactions that rows leave open") from error


def _method(name: str) -> Relation:
    def relation(b: Base, dice: random.Random) -> tuple:
        if b.options.get("stabilization", "projection") != "projection" and name == "radau":
            raise Unsupported("radau projects")
        if name == "radau" and has_functions(b.mechanism):
            raise Unsupported("Python functions have no derivatives")
        try:
            return _again(b, b.mechanism, method=name)
        except fb.SimulationError as error:
            if name == "radau" or "steps were taken up to t =" not in str(error):
                raise
            raise Unsupported("stiff: by explicit steps it takes too many") from error

    return relation


def common_tolerance(b: Base, dice: random.Random) -> tuple:
    if isinstance(b.options.get("method"), fb.Stepping) or "step" in b.options:
        raise Unsupported("steps have no tolerance")
    return _again(b, b.mechanism, rtol=COARSE, atol=1e-2 * COARSE)


def bystanders(b: Base, dice: random.Random) -> tuple:
    """Events that do nothing, at the instants at which limits and other events happen."""
    if isinstance(b.options.get("method"), fb.Stepping):
        raise Unsupported("impulse time stepping does not support events")
    m = copy.deepcopy(b.mechanism)
    limits = [x for x in b.mechanism.elements() if isinstance(x, fb.Limit)]
    bounds = [(x.coordinate, y) for x in limits for y in (x.lower, x.upper) if y is not None]
    conditions = [f"{coordinate} - ({bound})" for coordinate, bound in bounds]
    conditions += [x.when for x in b.mechanism.elements() if isinstance(x, fb.Event) and isinstance(x.when, str)]
    if not conditions:
        raise Unsupported("nothing happens")
    for k, when in enumerate(conditions):
        m.add(fb.Event(f"bystander {k}", when, do=[]))
    return _again(b, m)


def other_units(b: Base, dice: random.Random) -> tuple:
    s = Scale(*(10.0 ** dice.uniform(-2, 2) for _ in range(3)))
    m = scaled(b.mechanism, s)
    times = b.times * s.time
    options = {"atol": None} | {k: v for k, v in b.options.items() if k not in ("atol", "max_step", "step")}
    options["atol"] = ATOL * min(1.0, s.length, s.length / s.time, 1.0 / s.time)
    method = options.get("method")
    if isinstance(method, fb.Stepping):
        options["method"] = dataclasses.replace(
            method, step=method.step * s.time, tolerance=method.tolerance * s.length / s.time
        )
    run = simulated(m, b.t_end * s.time, times, options)
    per = {"position": s.length, "rotation": 1.0, "velocity": s.length / s.time, "angular_velocity": 1.0 / s.time}
    return run, m, lambda d: {k: v / per[k.split()[-1]] for k, v in d.items()}


def _turn_back(R: np.ndarray, shift: np.ndarray, planar: bool) -> Callable[[dict], dict]:
    """What the turned world's motion is in the axes of the first."""
    full = np.eye(3)
    full[: len(R), : len(R)] = R
    sign = np.linalg.det(R)

    def back(d: dict) -> dict:
        out = {}
        for k, v in d.items():
            what = k.split()[-1]
            if what == "rotation":
                a = v.reshape(-1, 3, 3)
                out[k] = (full.T @ a if sign > 0 else full.T @ a @ full).reshape(v.shape)
            elif what == "angular_velocity":
                out[k] = sign * v if planar else sign * (v @ R)
            else:
                out[k] = (v - (shift if what == "position" else 0.0)) @ R
        return out

    return back


def other_axes(b: Base, dice: random.Random) -> tuple:
    n = 2 if b.mechanism.planar else 3
    shift = np.array([dice.uniform(-3, 3) for _ in range(n)])
    if n == 2:
        a = dice.uniform(-3, 3)
        R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    else:
        R = matrix([dice.uniform(-3, 3) for _ in range(3)])
    back = _turn_back(R, shift, n == 2)
    m = changes.turned(b.mechanism, R, shift)
    start = {k: v[:1] for k, v in state(b.run, b.mechanism).items()}
    del start
    run = simulated(m, b.t_end, b.times, b.options)
    # bodies' own axes turn with the world: R' = R R_0
    return run, m, back


def mirror(b: Base, dice: random.Random) -> tuple:
    n = 2 if b.mechanism.planar else 3
    S = np.diag([1.0, -1.0]) if n == 2 else np.diag([-1.0, 1.0, 1.0])
    back = _turn_back(S, np.zeros(n), n == 2)
    return _again(b, changes.mirrored(b.mechanism), back)


def rename(b: Base, dice: random.Random) -> tuple:
    m, new = changes.renamed(b.mechanism)
    run = simulated(m, b.t_end, b.times, b.options)
    old = {v: k for k, v in new.items()}
    return run, m, lambda d: {f"{old[k.split()[0]]} {k.split()[-1]}": v for k, v in d.items()}


def reorder(b: Base, dice: random.Random) -> tuple:
    return _again(b, changes.reordered(b.mechanism, dice.randrange(10**6)))


def swap(b: Base, dice: random.Random) -> tuple:
    if b.mechanism.assemble().moved:  # it closes near the drawing; frames on the other body close as near, elsewhere
        raise Unsupported("a start that is not closed in the reference configuration")
    return _again(b, changes.swapped(b.mechanism))


def parameters(b: Base, dice: random.Random) -> tuple:
    return _again(b, changes.with_parameters(b.mechanism))


def file(b: Base, dice: random.Random) -> tuple:
    if has_functions(b.mechanism):
        raise Unsupported("a file holds no Python function")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "m.toml")
        b.mechanism.save(path)
        m = fb.load(path)
    if m != b.mechanism:
        raise AssertionError("what is read back is another mechanism")
    return _again(b, m)


def halves(b: Base, dice: random.Random) -> tuple:
    times = b.times
    k = len(times) // 2
    if isinstance(b.options.get("method"), fb.Stepping):
        raise Unsupported("another step in the middle")
    if len(b.run.t) != len(times):
        raise Unsupported("a motion that ends early")
    middle = 0.5 * (times[k] + times[k + 1])
    first = simulated(b.mechanism, float(middle), times[: k + 1], b.options)
    second = simulated(b.mechanism, b.t_end, np.r_[middle, times[k + 1 :]], b.options, start=first)
    one, two = state(first, b.mechanism), state(second, b.mechanism)
    joined = {n: np.concatenate([one[n], two[n][1:]]) for n in one}
    return _Joined(np.r_[np.asarray(first.t), np.asarray(second.t)[1:]], joined), b.mechanism, None


@dataclass
class _Joined:
    t: np.ndarray
    states: dict[str, np.ndarray]


RELATIONS: dict[str, Relation] = {
    "coordinates": other_coordinates, "dop853": _method("dop853"), "rk45": _method("rk45"), "radau": _method("radau"),
    "tolerance": common_tolerance, "units": other_units, "axes": other_axes, "mirror": mirror, "names": rename,
    "order": reorder, "swap": swap, "halves": halves, "parameters": parameters, "file": file, "bystanders": bystanders,
}  # fmt: skip


def compared(b: Base, chosen: list[str], seed: int) -> Iterator[tuple[str, str, Finding | None]]:
    """(relation, outcome, finding) of each: agrees, differs, unsupported, beyond, refused, raised."""
    now = state(b.run, b.mechanism)
    size = sizes(now, b.t_end)
    h = b.horizon
    for name in chosen:
        if h < 2:
            yield name, "beyond", None
            continue
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                run, m, back = RELATIONS[name](b, random.Random(f"{name} {seed}"))
        except Unsupported:
            yield name, "unsupported", None
            continue
        except fb.FlyballError as error:
            reached = int(np.searchsorted(b.run.t, getattr(error, "t", 0.0)))
            if own_error(b, name, seed)[:reached].max(initial=0.0) > AGREE:
                yield name, "beyond", None
                continue
            yield name, "refused", Finding(name, f"{type(error).__name__}: {str(error)[:300]}", np.nan, 0.0)
            continue
        except Exception as error:
            yield name, "raised", Finding(name, f"raised {type(error).__name__}: {str(error)[:300]}", np.nan, 0.0)
            continue
        yield name, *_outcome(b, run, m, back, name, now, size, h, seed)


SAME_EVENTS = ("coordinates", "dop853", "rk45", "radau", "axes", "order", "parameters", "file")
HOLDS = ("close", "stick", "lock", "latch", "taut", "touch", "rest")
RELEASES = ("open", "slip", "overrun", "unlatch", "slack", "part")
SWITCHED = (*HOLDS, *RELEASES, "impact")
NOTED = 1e-4  # of the whole time: instants may differ by
STILL, LOOKS = 10.0, 21  # times that, if nothing moves between them; times at which that is seen


def _happened(b: Base, run: Any, h: int) -> str:
    """What happened in one of the runs and not in the other, well before the end of what is compared.

    Each element counts alone, whichever others a record names with it. How often one goes back and forth within the
    time by which instants may differ, as under a load that grows from zero, says nothing: how it is left does. What
    holds nothing there may as well have held since the start.
    """
    if isinstance(b.options.get("method"), fb.Stepping):
        return ""
    near = NOTED * b.t_end
    lists = [
        [(sorted(re.split(r"[-\s]+", one)), x.kind, x.t) for x in r.events for one in x.name.split(", ")]
        for r in (b.run, run)
    ]
    for one, two, which in ((*lists, "only at first"), (*lists[::-1], "only then")):
        for name, kind, t in one:
            alike = any((name, kind) == (n, k) and abs(t - s) <= near for n, k, s in two)
            left = [
                [k not in RELEASES for n, k, s in every if n == name and abs(t - s) <= near] for every in (one, two)
            ]
            alike = alike or (all(left) and left[0][-1] == left[1][-1] and kind in SWITCHED)
            alike = alike or (kind in HOLDS and t <= near)
            alike = alike or any(
                (name, kind) == (n, k) and near < abs(t - s) <= STILL * near and _stands(b, t, s) for n, k, s in two
            )
            if t < b.run.t[h - 1] - 10 * near and not alike:
                return f"{' '.join(name)} {kind} at {t:.6g} s {which}"
    return ""


def _stands(b: Base, t: float, s: float) -> bool:
    """Whether nothing moves between two instants by more than motions may differ by, which cannot tell them apart."""
    between = np.linspace(min(t, s), max(t, s), LOOKS)
    run = simulated(b.mechanism, b.t_end, np.unique(np.r_[0.0, between, b.t_end]), b.options)
    now = {k: v[np.isin(run.t, between)] for k, v in state(run, b.mechanism).items()}
    first = {k: np.broadcast_to(v[:1], v.shape) for k, v in now.items()}
    return bool(difference(now, first, sizes(state(b.run, b.mechanism), b.t_end))[0].max() <= AGREE)


def _outcome(
    b: Base, run: Any, m: fb.Mechanism, back: Any, name: str, now: dict, size: dict, h: int, seed: int
) -> tuple:
    if len(run.t) != len(b.run.t):
        return "differs", Finding(name, f"ends after {len(run.t)} of {len(b.run.t)} outputs", np.nan, 0.0)
    other = run.states if isinstance(run, _Joined) else state(run, m)
    other = back(other) if back else other
    d, what = difference({k: v[:h] for k, v in now.items()}, {k: v[:h] for k, v in other.items()}, size)
    steps = isinstance(b.options.get("method"), fb.Stepping)
    allowed = (AGREE_STEPS if steps else AGREE) * np.maximum(1.0, b.growth[:h])
    allowed *= COARSER if name == "tolerance" else 1.0
    if not (d <= allowed).all():
        allowed = np.maximum(allowed, own_error(b, name, seed)[:h])
    ratio = d / allowed
    k = int(np.nanargmax(np.where(np.isfinite(ratio), ratio, np.inf)))
    if np.isfinite(ratio).all() and ratio.max() <= 1.0:
        other = _happened(b, run, h) if name in SAME_EVENTS else ""
        return ("differs", Finding(f"{name}, events", other, np.nan, 0.0)) if other else ("agrees", None)
    if doubts(run):
        return "warned", None
    return "differs", Finding(name, f"{what} at {b.run.t[k]:.6g} s", float(d[k]), float(allowed[k]))
