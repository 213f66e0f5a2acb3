"""What is taken up at a speed pushes at once: where a guard jumps as it passes zero, the instant is right all the same."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from tests.events.one_sided import LAYERS, times

RTOL = (1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
AWAY = 0.75  # m, of a rope's other end, beside the slide
PLACE = 0.6  # m, where each is met
PUSH = {"stiffness": 400.0, "damping": 1.0}
MET = {
    "rope": lambda: fb.Rope("e", ("ground", "b"), at=((0, AWAY), (0, 0)), length=np.hypot(AWAY, PLACE), **PUSH),
    "limit": lambda: fb.Limit("e", "P.displacement", upper=PLACE, **PUSH),
    "backlash": lambda: fb.Backlash("e", ["P.displacement"], gap=2 * PLACE, **PUSH),
    "law": lambda: fb.Event("e", f"where(P.displacement < {PLACE}, P.displacement - {PLACE}, 50)", direction="rising"),
    "step": lambda: fb.Event("e", f"where(P.displacement < {PLACE}, -.01, 50)", direction="rising"),
}


@pytest.mark.parametrize("coordinates", LAYERS)
@pytest.mark.parametrize("kind", MET)
def test_it_is_met_when_it_is(kind, coordinates):
    """A kilogram on a spring: x = sin 2 t."""
    m = fb.Mechanism("swing", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1))
    m.add(fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(1, 0)), fb.Initial("P.displacement", rate=2.0))
    m.add(fb.CoordinateSpring("k", "P.displacement", stiffness=4.0), MET[kind]())
    met = np.arcsin(PLACE) / 2
    for rtol in RTOL:
        r = m.simulate(met + 0.01, outputs=2, rtol=rtol, atol=1e-2 * rtol, coordinates=coordinates)
        assert times(r, "e") == pytest.approx([met], abs=max(1e-12, rtol)), rtol
        assert r.events[0].before["P.displacement"] == pytest.approx(PLACE, abs=1e-13), rtol
