"""Every force element, found by registry: power = -dE/dt, and the same numbers compiled, plain, real and complex."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flyball import forces
from tests.contract.test_rows import moved, random_motion, record

PAR = (30.0, 2.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.1)


def pair(kind):
    """Two frames; a torque about an axis needs them hinged, with a common z axis."""
    F, M = random_motion(4)
    if kind.on_joint:
        spin = 0.7
        M["p"], M["v"], M["a"] = F["p"], F["v"], F["a"]
        M["R"] = F["R"] @ Rotation.from_rotvec([0, 0, 0.9]).as_matrix()
        M["w"] = F["w"] + spin * F["R"][:, 2]
    return F, M


def power(kind, par, F, M, laws=(0.0, 0.0, 0.0)):
    f, t = kind.wrench(par, record(F), record(M), laws, kind.inputs(par, record(F), record(M), 0.0))
    d = M["p"] - F["p"]
    return np.dot(f, M["v"] - F["v"] - np.cross(F["w"], d)) + np.dot(t, M["w"] - F["w"])


@pytest.mark.parametrize("kind", forces.ALL, ids=lambda k: k.__name__)
def test_power_is_minus_the_rate_of_the_energy(kind):
    """What a spring without damping gives to the bodies it loses itself; elements without energy store nothing."""
    F, M = pair(kind)
    par = (PAR[0], 0.0, *PAR[2:])
    if kind.energy is None:
        assert power(kind, par, F, M) == pytest.approx(0.0, abs=1e-12)
        return
    h = 1e-5
    ahead, behind = (kind.energy(par, record(moved(F, s)), record(moved(M, s)), 0.0) for s in (h, -h))
    assert power(kind, par, F, M) == pytest.approx(-(ahead - behind) / (2 * h), rel=1e-7)


@pytest.mark.parametrize("kind", forces.ALL, ids=lambda k: k.__name__)
def test_damping_takes_power(kind):
    F, M = pair(kind)
    if kind.energy is not None:
        par = (0.0, *PAR[1:])
        assert power(kind, par, F, M) < 0.0


@pytest.mark.parametrize("kind", forces.ALL, ids=lambda k: k.__name__)
def test_inputs_are_a_coordinate_and_its_rate(kind):
    F, M = pair(kind)
    h = 1e-6
    x = [kind.inputs(PAR, record(moved(F, s)), record(moved(M, s)), 0.0)[0] for s in (h, -h)]
    assert kind.inputs(PAR, record(F), record(M), 0.0)[1] == pytest.approx((x[0] - x[1]) / (2 * h), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("kind", forces.ALL, ids=lambda k: k.__name__)
def test_complex_numbers_without_imaginary_part_change_nothing(kind):
    F, M = pair(kind)
    laws = (1.0, -2.0, 0.5)
    real = kind.wrench(PAR, record(F), record(M), laws, kind.inputs(PAR, record(F), record(M), 0.0))
    F, M = record(F, complex), record(M, complex)
    other = kind.wrench(PAR, F, M, laws, kind.inputs(PAR, F, M, 0.0))
    for a, b in zip(real, other, strict=True):
        assert np.asarray(b, complex) == pytest.approx(np.asarray(a, complex), rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("kind", forces.ALL, ids=lambda k: k.__name__)
def test_kind_stands_in_dispatch(kind):
    """A force that dispatch does not list would be described and never act."""
    import inspect

    from flyball.system import dispatch

    module = kind.__module__.rsplit(".", 1)[1]
    assert f"F.{module}.wrench" in inspect.getsource(dispatch)


def test_kind_numbers_are_distinct():
    assert sorted(k.kind for k in forces.ALL) == list(range(len(forces.ALL)))
