"""The mechanisms of the benchmarks: as plain numbers, as flyball models, and their exact motions.

Sources
-------
N-four-bar: problem A02 of the IFToMM library of computational benchmark problems (Gonzalez et al., 2006). It
passes singular positions twice a turn, where its mobility jumps from 1 to N + 1.
Simple pendulum: problem A01 of the same library; its motion in Jacobi's elliptic functions.
Free body: Euler's equations in Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, section 37).
"""

from __future__ import annotations

import runpy
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import flyball as fb
from flyball.engine.entry_point import INTEGRATE
from flyball.numerics.integrators.butcher_tableaux import tableau
from flyball.progress import no_progress
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.integration_options import MOST_STEPS, default_integration
from flyball.simulation.simulate import clock_for, run_compiled_loop

GRAVITY = 9.81
ROD = 1.0 / 12.0  # moment of inertia of a uniform rod of 1 m and 1 kg [kg m^2]
GROUND = -1
RTOL = 1e-7  # of `simulate` unless given
CHAIN_ANGLE = np.pi / 6  # of the serial pendulum from hanging, at the start [rad]
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def simulate(model: fb.Mechanism, t_end: float, *, coordinates: str = "auto", **options: Any) -> fb.Result:
    """flyball's ``simulate`` in the coordinates asked for."""
    return model.simulate(t_end, coordinates=coordinates, **options)


def started(model: fb.Mechanism, coordinates: str = "auto") -> tuple[Any, Any]:
    """(compiled mechanism, state at the start) in the coordinates asked for."""
    start = find_initial_state(model.snapshot(), 0.0, None, None, coordinates)
    return start.assembly.compiled, start.y


class Kernel:
    """flyball's compiled loop over a motion, ready to be called again and again: what `simulate` does without the rest.

    Built from the same objects that ``simulate`` makes; only the loop is timed. ``task``: FOLLOW for mechanisms whose
    drivers leave no freedom.
    """

    def __init__(
        self, model: fb.Mechanism, t_end: float, outputs: int, *, task: int = INTEGRATE, **options: Any
    ) -> None:
        o = {"method": "dop853", "coordinates": "auto", "rtol": RTOL, "atol": None, "max_steps": MOST_STEPS} | options
        self.start = find_initial_state(model.snapshot(), 0.0, None, None, o["coordinates"])
        made = default_integration(o["coordinates"], o["rtol"], o["atol"], o["max_steps"])
        self.asked = replace(made, method=o["method"])
        self.times, self.task = np.linspace(0.0, t_end, outputs), task

    def seconds(self) -> float:
        """CPU seconds of one motion."""
        clock = clock_for(self.start, 0.0, self.times[-1], self.times, self.asked)
        method = tableau(self.asked.method)
        begun = time.process_time()
        run_compiled_loop(self.start.assembly, clock, method, no_progress, self.task)
        return time.process_time() - begun


def example(name: str, **options: Any) -> fb.Mechanism:
    """A mechanism of the examples folder."""
    if name.endswith(".py"):
        return runpy.run_path(str(EXAMPLES / name))["mechanism"](**options)
    return fb.load(EXAMPLES / name)


@dataclass(frozen=True)
class Planar:
    """A planar mechanism of rods as numbers, counted from the centres of mass.

    ``start`` (bodies, 3): x, y, angle; ``rate`` their rates; ``hinges``: (body, its point, body, its point).
    ``springs``: the same, stiffness and free length.
    """

    name: str
    mass: np.ndarray
    inertia: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    hinges: tuple[tuple[int, tuple[float, float], int, tuple[float, float]], ...]
    gravity: float = GRAVITY
    torques: tuple[tuple[int, float], ...] = ()  # body, constant torque on it
    springs: tuple[tuple[int, tuple[float, float], int, tuple[float, float], float, float], ...] = ()
    motors: tuple[tuple[int, float, float, float, float], ...] = ()  # hinge, and numbers of a `trees.Motor`


def fourbars(n: int) -> Planar:
    """A02: ``n`` windows of 2 n + 1 rods of 1 m and 1 kg, upright, the joints on top moving at 1 m/s."""
    upright = [(i, 0.5, np.pi / 2) for i in range(n + 1)]
    level = [(i + 0.5, 1.0, 0.0) for i in range(n)]
    hinges = [(GROUND, (float(i), 0.0), i, (-0.5, 0.0)) for i in range(n + 1)]
    for i in range(n):
        hinges.append((i, (0.5, 0.0), n + 1 + i, (-0.5, 0.0)))
        hinges.append((n + 1 + i, (0.5, 0.0), i + 1, (0.5, 0.0)))
    rods = 2 * n + 1
    rate = np.array([(0.5, 0.0, -1.0)] * (n + 1) + [(1.0, 0.0, 0.0)] * n)
    return Planar(f"fourbars-{n}", np.ones(rods), np.full(rods, ROD), np.array(upright + level), rate, tuple(hinges))


def chain(n: int) -> Planar:
    """Serial pendulum of ``n`` slender rods, 1 m and 1 kg in all, straight at 30 deg from hanging, at rest."""
    angle = CHAIN_ANGLE - np.pi / 2
    along = np.array([np.cos(angle), np.sin(angle)])
    middles = (np.arange(n)[:, None] + 0.5) / n * along
    start = np.column_stack([middles, np.full(n, angle)])
    ends = (-0.5 / n, 0.0), (0.5 / n, 0.0)
    hinges = [(GROUND, (0.0, 0.0), 0, ends[0]), *((i - 1, ends[1], i, ends[0]) for i in range(1, n))]
    mass, inertia = np.full(n, 1.0 / n), np.full(n, 1.0 / n**3 / 12.0)
    return Planar(f"chain-{n}", mass, inertia, start, np.zeros((n, 3)), tuple(hinges))


def fourbars_exact(n: int, t: np.ndarray) -> np.ndarray:
    """Position of the first joint on top, (times, 2), on the branch where the bars stay parallel: one angle."""
    m, k = (n + 1) / 3 + n, GRAVITY * ((n + 1) / 2 + n)

    def rate(_: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], k / m * np.sin(y[0])

    s = solve_ivp(rate, (0.0, t[-1]), (0.0, 1.0), "DOP853", t, rtol=1e-13, atol=1e-13)
    return np.stack([np.sin(s.y[0]), np.cos(s.y[0])], axis=1)


def flyball_planar(p: Planar) -> fb.Mechanism:
    """The same mechanism, described to flyball."""
    m = fb.Mechanism(p.name, planar=True, gravity=(0.0, -p.gravity))
    for i, ((x, y, angle), (vx, vy, w)) in enumerate(zip(p.start.tolist(), p.rate.tolist(), strict=True)):
        m.add(fb.Body(f"rod{i}", mass=float(p.mass[i]), inertia=float(p.inertia[i]), position=(x, y), angle=angle,
                      velocity=(vx, vy), angular_velocity=w))  # fmt: skip
    for k, (i, at, j, _) in enumerate(p.hinges):
        where = at if i == GROUND else tuple(float(c[0]) for c in point(p.start[None], i, at).T)
        m.add(fb.Revolute(f"hinge{k}", "ground" if i == GROUND else f"rod{i}", f"rod{j}", at=where))
    for k, (hinge, *law) in enumerate(p.motors):
        m.add(fb.Motor(f"motor{k}", f"hinge{hinge}", torque=following(*law)))
    for k, (i, at_i, j, at_j, stiffness, length) in enumerate(p.springs):
        ends = tuple(tuple(point(p.start[None], b, at)[0].tolist()) for b, at in ((i, at_i), (j, at_j)))
        names = ["ground" if b == GROUND else f"rod{b}" for b in (i, j)]
        m.add(fb.SpringDamper(f"spring{k}", *names, at=ends, stiffness=stiffness, length=length))
    return m


def following(stiffness: float, damping: float, swing: float, speed: float) -> str:
    """The torque of a PD law that follows swing (1 - cos(speed t)), as an expression of t, angle and rate."""
    turn = f"{speed!r}*t"
    return f"{stiffness!r}*({swing!r}*(1 - cos({turn})) - angle) + {damping!r}*({swing * speed!r}*sin({turn}) - rate)"


def point(q: np.ndarray, body: int, at: tuple[float, float]) -> np.ndarray:
    """Point of a body in the world, (times, 2), from coordinates (times, bodies, 3)."""
    if body == GROUND:
        return np.tile(np.asarray(at, float), (len(q), 1))
    x, y, angle = q[:, body].T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([x + c * at[0] - s * at[1], y + s * at[0] + c * at[1]], axis=1)


def energy(p: Planar, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Kinetic and potential energy [J] along coordinates and rates of shape (times, bodies, 3)."""
    kinetic = 0.5 * (p.mass * (v[:, :, 0] ** 2 + v[:, :, 1] ** 2) + p.inertia * v[:, :, 2] ** 2)
    return (kinetic + p.mass * GRAVITY * q[:, :, 1]).sum(axis=1)


def gap(p: Planar, q: np.ndarray) -> float:
    """Largest distance in one coordinate between the two points of a hinge [m]."""
    return max(float(np.abs(point(q, i, a) - point(q, j, b)).max()) for i, a, j, b in p.hinges)


def planar_motion(p: Planar, run: fb.Result) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and rates of the rods in flyball's result, (times, bodies, 3)."""
    views = [run[f"rod{i}"] for i in range(len(p.mass))]
    q = np.stack([np.column_stack([b.position, b.angle]) for b in views], axis=1)
    return q, np.stack([np.column_stack([b.velocity, b.angular_velocity]) for b in views], axis=1)


def pendulum() -> fb.Mechanism:
    """A01: point mass of 1 kg on a massless rod of 1 m, at rest in the horizontal."""
    m = fb.Mechanism("pendulum", planar=True, gravity=(0.0, -GRAVITY))
    m.add(fb.Body("mass", mass=1.0, inertia=0.0, position=(1.0, 0.0)))
    m.add(fb.Revolute("pivot", "ground", "mass", at=(0.0, 0.0)))
    return m


def pendulum_exact(t: np.ndarray) -> np.ndarray:
    """Position of its mass, (times, 2): sin(theta / 2) = k sn(K - w t) with k^2 = 1/2."""
    m = 0.5
    sn, cn, dn, _ = ellipj(ellipk(m) - np.sqrt(GRAVITY) * t, m)
    sine, cosine = np.sqrt(m) * sn, dn  # of half the angle from the hanging position
    return np.stack([2.0 * sine * cosine, 2.0 * sine**2 - 1.0], axis=1)


MOMENTS = (1.0, 2.0, 3.0)  # of the free body [kg m^2]
SPIN = (0.1, 0.0, 1.0)  # its angular velocity at the start [rad/s]


def free_body() -> fb.Mechanism:
    """A body with three different moments of inertia, turning freely."""
    m = fb.Mechanism("free body", gravity=(0.0, 0.0, 0.0))
    m.add(fb.Body("body", mass=1.0, inertia=MOMENTS, angular_velocity=SPIN))
    return m


def free_body_exact(t: np.ndarray) -> np.ndarray:
    """Its angular velocity in body axes, (times, 3)."""
    i1, i2, i3 = MOMENTS
    e2 = i1 * SPIN[0] ** 2 + i3 * SPIN[2] ** 2  # twice the energy
    l2 = (i1 * SPIN[0]) ** 2 + (i3 * SPIN[2]) ** 2  # angular momentum squared; here l2 > i2 e2
    p = np.sqrt((i3 - i2) * (l2 - e2 * i1) / (i1 * i2 * i3))
    m = (i2 - i1) * (e2 * i3 - l2) / ((i3 - i2) * (l2 - e2 * i1))
    sn, cn, dn, _ = ellipj(p * t, m)
    a1 = np.sqrt((e2 * i3 - l2) / (i1 * (i3 - i1)))
    a2 = np.sqrt((e2 * i3 - l2) / (i2 * (i3 - i2)))
    a3 = np.sqrt((l2 - e2 * i1) / (i3 * (i3 - i1)))
    return np.stack([a1 * cn, a2 * sn, a3 * dn], axis=1)
