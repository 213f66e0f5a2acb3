"""A mechanism at a random state twice: its equations as expressions, and a result made of numbers alone."""

from __future__ import annotations

import numpy as np

from flyball.results.result import Result
from tests.symbolic.test_engine_agreement import quaternions_of


def random_state(m, coordinates, seed=3, spread=0.1):
    """Equations, a result of one instant near the start, and the values of all symbols there.

    Accelerations and multipliers are any: no equation of motion is fulfilled.
    """
    eq = m.symbolic(coordinates=coordinates)
    c = eq.assembly.compiled
    s, rng = c.structure, np.random.default_rng(seed)
    q = eq.assembly.q + spread * rng.normal(size=s.nq)
    for k in quaternions_of(c):
        q[k : k + 4] /= np.linalg.norm(q[k : k + 4])
    t, v, vdot = 0.3, rng.normal(size=s.nv), rng.normal(size=s.nv)
    lam = rng.normal(size=len(s.rows) + len(s.prescribed))
    c.at(t, q, v)
    arrays = (np.array(x)[None] for x in (q, v, c.z, vdot, lam))
    q, v, z, vdot, lam = arrays
    result = Result(m.snapshot(), c.values, np.array([t]), q, v, z, vdot, lam, health=None)
    values = eq.state(t, q[0], v[0], z[0])
    values |= dict(zip(eq.vdot.rows, vdot[0], strict=True)) | dict(zip(eq.lam.rows, lam[0], strict=True))
    places = {k: z[0, s.state_at[k]] for k in eq.places}
    values |= places
    values |= dict(zip(eq.loads.rows, eq.load_values.at(values), strict=True))
    return eq, result, values
