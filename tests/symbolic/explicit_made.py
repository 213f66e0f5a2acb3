"""Mechanisms of these tests, and the numeric engine's accelerations to compare with."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import flyball as fb
from flyball.engine.calls import MOTION
from flyball.expression_graph.graph import evaluate
from flyball.simulation.initial_state import find_initial_state
from flyball.symbolic.explicit.explicit_equations import StateEquations


def pendulum() -> fb.Mechanism:
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, "-g"), parameters={"g": 9.81, "m": 2.0, "l": 0.7, "I": 0.1})
    m.add(fb.Body("rod", mass="m", inertia="I", position=(0, "-l")))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    return m


def cart_pole() -> fb.Mechanism:
    """A point-like bob of mass m at the length l under a cart of mass M that a force F pushes."""
    numbers = {"M": 1.3, "m": 0.4, "l": 0.6, "g": 9.81, "F": 0.0}
    m = fb.Mechanism("cart-pole", planar=True, gravity=(0, "-g"), parameters=numbers)
    m.add(fb.Body("cart", mass="M", inertia=1.0), fb.Body("pole", mass="m", inertia=1e-30, position=(0, "-l")))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "pole", at=(0, 0)))
    m.add(fb.PointForce("push", "cart", at=(0, 0), axes="world", force=("F", 0)))
    return m


def states_of(m: fb.Mechanism, coordinates: str = "auto", independent=(), inputs=(), outputs=()) -> StateEquations:
    return m.symbolic(coordinates=coordinates, inputs=inputs).state_space(outputs, independent=independent)


@lru_cache(maxsize=4)
def _nodes(s: StateEquations) -> list:
    e, n = s.explicit.solution, s.explicit.solution.traced
    own = [n.graph.node(y) for y in s.equations.named_equations.user_q]
    return e.inlined([*own, *n.v, *s.equations.named_equations.vdot])


def engine(m: fb.Mechanism, coordinates: str, t: float, q, v, values=None) -> np.ndarray:
    """Accelerations (nv,) by the numeric engine; followers are where ``values`` say."""
    c = find_initial_state(m.snapshot(), 0.0, None, None, coordinates).assembly.compiled
    for name, at in c.structure.state_at.items():
        c.z[at] = (values or {}).get(name, c.z[at])
    status, dy = c.at(t, np.array(q, float), np.array(v, float), MOTION)
    assert status == 0
    return dy[len(q) : len(q) + len(v)]


def whole(s: StateEquations, x, t: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The engine's coordinates, velocities and accelerations at a state."""
    n = s.explicit.solution.traced
    found = np.array(evaluate(_nodes(s), s.point(x, t=t)), float)
    nq, nv = len(n.q), len(n.v)
    return found[:nq], found[nq : nq + nv], found[nq + nv :]


def differs(m: fb.Mechanism, s: StateEquations, coordinates: str, x, t: float = 0.0) -> float:
    """How far accelerations are from the engine's, relative to the largest."""
    q, v, a = whole(s, x, t)
    exact = engine(m, coordinates, t, q, v)
    return float(np.abs(a - exact).max() / np.abs(exact).max())
