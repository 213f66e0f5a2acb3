"""Jacobians put together from the parts of the equations, against steps of one velocity at a time through the whole."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import flyball as fb
from flyball.constraints.switches.switch_kind import HELD, OFF
from flyball.derivatives.equation_derivatives import COMPLEX_STEP, EquationDerivatives, MechanismState
from flyball.engine.calls import INERTIAL_TERMS, RESIDUAL_TERMS, ResidualBatch
from flyball.engine.residual import residuals_kernel
from flyball.simulation.initial_state import find_initial_state
from flyball.simulation.jacobian_pattern import jacobian_layout
from flyball.simulation.method_choice import with_contact_points
from flyball.tables.table_definitions import SLIDING
from tests.contract.test_everything import everything
from tests.contract.zoo import joined
from tests.mechanisms import example

EXAMPLES = ("andrews.toml", "bricard.toml", "car_axis.toml", "governor.toml", "rolling_race.toml", "n_four_bar.py")
JOINTS = ("Cam", "Cylindrical", "KnifeEdge", "RollingDisk", "Screw", "Universal")


def sledge():
    """A ball that slides on the floor, and a joint with friction that its reaction presses."""
    m = fb.Mechanism("sledge", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))), fb.Contact(friction=0.3))
    m.add(fb.Body("a", shape=fb.Sphere(radius=0.1), density=200, position=(0, 0, 0.1), velocity=(1, 0.5, 0)))
    m.add(fb.Body("b", mass=0.5, inertia=(0.1, 0.2, 0.3), position=(0.3, 0, 0.4), orientation=(0.1, 0.2, 0.3)))
    m.add(fb.Revolute("pin", "a", "b", at=(0.1, 0, 0.2), axis=(1, 2, 0)))
    m.add(fb.JointFriction("rubs", "pin", radius=0.02, kinetic=0.3, static=0.3, stick_speed=0.05))
    return m


MODELS = {n: lambda n=n: example(n) for n in EXAMPLES} | {n: lambda n=n: joined("space", n) for n in JOINTS}
MODELS |= {"everything": everything, "sledge": sledge}


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
@pytest.mark.parametrize("name", MODELS)
def test_jacobians_from_parts_are_those_of_the_whole(name, coordinates):
    """At random velocities, accelerations and multipliers."""
    start = find_initial_state(
        with_contact_points(MODELS[name]().snapshot(), None), 0.0, None, None, coordinates, switches=True
    )
    c = start.assembly.compiled
    s, S, rng = c.structure, c.system, np.random.default_rng(0)
    x = MechanismState.moving(c, 0.1, start.y[: s.nq], start.y[s.nq : s.nq + s.nv] + rng.normal(size=s.nv))
    x.vdot, x.lam = rng.normal(size=s.nv), rng.normal(size=len(s.rows))
    full = EquationDerivatives(x)
    SC, WC = (x.fields for x in c.complex_tables)
    for slip in S.forces.switch[S.forces.family == SLIDING]:
        WC.modes.mode[slip], WC.modes.mode[S.switches.other[slip]] = OFF, HELD
    made, nv = jacobian_layout(s, S), s.nv

    def by(kinds, terms, task):
        nx = made.nx  # states follow the velocities
        steps = np.zeros((len(kinds) * terms.groups, 3 * nv + 1 + nx), complex)
        for n, kind in enumerate(kinds):
            steps[n * terms.groups + terms.group[:nv], kind * nv + np.arange(nv)] = 1j * COMPLEX_STEP
        out = np.zeros((len(steps), made.places), complex)
        t, y, vdot, lam = np.array([x.t + 0j]), x.y.astype(complex), x.vdot.astype(complex), x.lam.astype(complex)
        bench = ResidualBatch(t, y, vdot, lam, steps, out)
        residuals_kernel(SC, WC, bench, bench, bench, task)
        entry, step, place = terms.pick.T
        found = [out[step + n * terms.groups, place].imag / COMPLEX_STEP for n in range(len(kinds))]
        size = nv + nx + len(s.rows), nv + nx
        whole = [csr_matrix((f, (terms.i[entry], terms.j[entry])), shape=size).toarray() for f in found]
        return [np.delete(J, np.arange(nv, nv + nx), axis=0)[:, :nv] for J in whole]

    (P, D), (M,) = by((0, 1), made.terms, RESIDUAL_TERMS), by((2,), made.mass, INERTIAL_TERMS)
    for J, whole in ((P, full.by_position), (D, full.by_velocity), (M, full.by_acceleration)):
        exact = whole.toarray()[np.r_[np.arange(nv), np.arange(full.at["n"].start, full.at["n"].stop)]]
        size = nv if J is M else len(exact)
        assert np.abs(J - exact)[:size].max() <= 1e-11 * max(1.0, np.abs(exact).max())
