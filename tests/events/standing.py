"""A motion that stands at its start, with the rows that have modes: what is decided there is tested by itself."""

from __future__ import annotations

import inspect

import numpy as np

from flyball.simulation.events.context import EventContext
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.method_choice import SimulateOptions
from flyball.simulation.simulate import clock_for

ASKED = {
    "method": "dop853", "t_end": 1.0, "t_start": None, "outputs": 2, "parameters": None, "start": None,
    "specialize": False, "progress": False, "rtol": 1e-9, "atol": None, "max_step": np.inf, "max_steps": 1000,
    "stabilization": "projection", "alpha": None, "beta": None, "step": None, "rho_inf": None,
}  # fmt: skip


def standing(m, coordinates) -> EventContext:
    """Of a mechanism, at t = 0, nothing decided yet."""
    more = {"switches": True} if "switches" in inspect.signature(find_initial_state).parameters else {}
    start = find_initial_state(m.snapshot(), 0.0, None, None, coordinates, **more)
    clock = clock_for(start, 0.0, 1.0, np.array([0.0, 1.0]), SimulateOptions(**ASKED, coordinates=coordinates))
    return EventContext(start, clock)


def modes(here: EventContext) -> list[float]:
    """Of all switches."""
    return here.c.work.modes.mode.tolist()


def ways(here: EventContext) -> list[float]:
    """Ways of all switches."""
    n = len(here.c.system.switches.row)
    return here.c.work.sensed.value[here.c.work.sensed.shape[1] - n :].tolist()


def moving(here: EventContext) -> dict[str, np.ndarray]:
    """(vx, vy, turning rate) of every body."""
    c = here.c
    bodies = c.moving(here.t, here.q, here.v)
    return {name: np.array([b.v[0], b.v[1], b.w[2]]) for name, b in bodies.items()}


def kicked(here: EventContext, body: str, at, impulse) -> np.ndarray:
    """Generalised impulse of a blow on a body at a point of the plane, by virtual work."""
    c = here.c
    before, v = here.v.copy(), np.zeros(c.structure.nv)
    out = np.zeros(c.structure.nv)
    for d in range(len(out)):
        v[:] = 0.0
        v[d] = 1.0
        b = c.moving(here.t, here.q, v)[body]
        arm = np.asarray(at, float) - b.p[:2]
        out[d] = impulse[0] * (b.v[0] - b.w[2] * arm[1]) + impulse[1] * (b.v[1] + b.w[2] * arm[0])
    here.v[:] = before
    return out
