"""Every constraint row, found by registry: Jacobian, acceleration term, action and reaction, any kind of number."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flyball.constraints import alignment, skew_lines, tangent
from flyball.constraints import angle as angle_row
from flyball.constraints.registry import KINDS
from flyball.testing.formula_checks import complex_step_frame, frame_record, moved_frame, random_motion
from tests.contract.frames import (
    ASSEMBLY,
    CASES,
    DATA,
    PARAMETERS,
    WORLD,
    elsewhere,
    evaluated,
    frames,
    has_value,
    label,
    rate,
)

PLACES = ("flyball.constraints.corner_on_box", "flyball.constraints.ball_on_box")
"""Of places of contact: along motions, in `tests/identities/test_contact_rows.py`."""

every = pytest.mark.parametrize("case", CASES, ids=label)
holonomic = pytest.mark.parametrize("case", [c for c in CASES if has_value(c)], ids=label)
seeds = pytest.mark.parametrize("seed", range(3))


def test_every_kind_has_its_cases():
    places = {k.number for k in KINDS if k.row.__module__ in PLACES}
    assert set(PARAMETERS) | set(ASSEMBLY) | places == set(range(len(KINDS)))


@holonomic
@seeds
def test_wrench_is_the_gradient_of_the_value(case, seed):
    """G v = dg/dt off the constraint: by a complex step along a first-order motion, and by central differences."""
    F, M, hint = frames(case, seed)
    G_v = rate(evaluated(case, F, M, hint), F, M)
    e = 1e-30
    value = evaluated(case, complex_step_frame(F, e), complex_step_frame(M, e), hint, complex)[0]
    assert np.imag(value) / e == pytest.approx(G_v, rel=1e-11, abs=1e-12)
    h = 1e-5
    ahead, behind = (evaluated(case, moved_frame(F, s), moved_frame(M, s), hint)[0] for s in (h, -h))
    assert (ahead - behind) / (2 * h) == pytest.approx(G_v, rel=1e-7, abs=1e-7)


@holonomic
def test_wrench_is_the_gradient_of_the_value_on_the_constraint(case):
    """Where the row is fulfilled too: it is put there along its own gradient."""
    F, M, hint = frames(case, 1)
    hint = 0.0 if case[0] in (angle_row.KIND, tangent.KIND) else hint
    for _ in range(30):
        out = evaluated(case, F, M, hint)
        f, t = np.array(out[1]), np.array(out[2])
        step = -out[0] / (f @ f + t @ t)
        M["p"], M["R"] = M["p"] + step * f, Rotation.from_rotvec(step * t).as_matrix() @ M["R"]
    out = evaluated(case, F, M, hint)
    assert out[0] == pytest.approx(0.0, abs=1e-12)
    e = 1e-30
    value = evaluated(case, complex_step_frame(F, e), complex_step_frame(M, e), hint, complex)[0]
    assert np.imag(value) / e == pytest.approx(rate(out, F, M), rel=1e-11, abs=1e-12)


@every
@seeds
def test_bias_is_the_second_derivative(case, seed):
    """With true accelerations in the records the bias is d2g/dt2, or the derivative of the rate: off the constraint."""
    F, M, hint = frames(case, seed)
    bias = evaluated(case, F, M, hint)[4]
    h = 1e-4
    rates = []
    for s in (2 * h, h, -h, -2 * h):
        f, m = moved_frame(F, s), moved_frame(M, s)
        rates.append(rate(evaluated(case, f, m, hint), f, m))
    assert (8 * (rates[1] - rates[2]) - (rates[0] - rates[3])) / (12 * h) == pytest.approx(bias, rel=1e-7, abs=1e-6)


@every
@seeds
def test_bias_accelerations_count_as_accelerations(case, seed):
    """G vdot + bias is the same whether accelerations come from vdot or, in joint coordinates, from the records."""
    F, M, hint = frames(case, seed)
    full = evaluated(case, F, M, hint)
    still = [m | {"alpha": np.zeros(3), "a": np.zeros(3)} for m in (F, M)]
    bare = evaluated(case, *still, hint)
    assert full[4] == pytest.approx(bare[4] + rate(full, F, M, "alpha", "a"), rel=1e-11, abs=1e-12)
    assert full[:4] == bare[:4]


@every
def test_action_equals_reaction(case):
    """A rigid motion of both frames together needs no power: the two wrenches balance, moments included.

    Rows that speak of the world's axes do so where they are closed.
    """
    F, M, hint = frames(case, 7)
    if case[0] in WORLD:
        f, m = F["R"][:, 2], M["R"][:, 2]
        s1, s2, k = PARAMETERS[case[0]][case[1]][3:6] if case[0] == skew_lines.KIND else (0.0, 0.0, 0.0)
        M["p"] = F["p"] + s1 * f + s2 * m + k * np.cross(f, m)
    _, f, tM, tF, _ = (np.array(x) for x in evaluated(case, F, M, hint))
    assert tM + tF + np.cross(M["p"] - F["p"], f) == pytest.approx(np.zeros(3), abs=1e-12)


@every
def test_nothing_depends_on_the_world(case):
    """The world turned and moved by 10 km: the same value and bias, the wrench turned with it."""
    F, M, hint = frames(case, 11)
    here = evaluated(case, F, M, hint)
    f, m, par, Q = elsewhere(case, F, M)
    there = KINDS[case[0]].row(par, frame_record(f), frame_record(m), hint, DATA)
    assert there[0] == pytest.approx(here[0], rel=1e-10, abs=1e-10)
    assert there[4] == pytest.approx(here[4], rel=1e-9, abs=1e-9)
    for a, b in zip(here[1:4], there[1:4], strict=True):
        assert np.array(b) == pytest.approx(Q @ np.array(a), rel=1e-9, abs=1e-9)


@every
def test_complex_numbers_without_imaginary_part_change_nothing(case):
    F, M, hint = frames(case, 5)
    real, other = evaluated(case, F, M, hint), evaluated(case, F, M, hint, complex)
    for a, b in zip(real, other, strict=True):
        assert np.asarray(b) == pytest.approx(np.asarray(a, complex), rel=1e-13, abs=1e-13)


@every
def test_arrays_over_time_are_so_many_numbers(case):
    """Results run the rows on arrays over time: each entry is what the numbers of that time give."""
    single = [frames(case, seed) for seed in range(4)]
    F, M = (_over_time([frame_record(s[side]) for s in single]) for side in range(2))
    kind, name = case
    out = KINDS[kind].row(PARAMETERS[kind][name], F, M, np.array([hint for _, _, hint in single]), DATA)
    for k, (f, m, hint) in enumerate(single):
        for a, b in zip(evaluated(case, f, m, hint), out, strict=True):
            picked = [np.broadcast_to(x, 4)[k] for x in b] if isinstance(b, tuple) else np.broadcast_to(b, 4)[k]
            assert np.asarray(picked) == pytest.approx(np.asarray(a), rel=1e-13, abs=1e-13)


def _over_time(records):
    """One record of arrays from records of single times."""
    return tuple(tuple(np.array(x) for x in zip(*parts, strict=True)) for parts in zip(*records, strict=True))


@pytest.mark.parametrize("angle", [1e-12, 0.4, 2.0, 3.0, np.pi])
def test_alignment_measures_the_true_angle(angle):
    """The stand-ins of assembly give the rotation vector, up to half a turn, where perpendicular rows give its sine."""
    F, M = random_motion(2)
    axis = np.array([0.6, 0.8, 0.0])
    M["R"] = F["R"] @ Rotation.from_rotvec(angle * axis).as_matrix()
    unit = np.eye(3)
    ends = frame_record(F), frame_record(M), 0.0, DATA
    full = [alignment.full_row((*unit[i], 0, 0, 0, 0, 1), *ends)[0] for i in range(3)]
    tilt = [alignment.axis_row((*unit[i], 0, 0, 0, 0, 1), *ends)[0] for i in range(2)]
    assert np.linalg.norm(full) == pytest.approx(angle, abs=1e-7)
    assert np.linalg.norm(tilt) == pytest.approx(angle, abs=1e-7) or angle == np.pi
    if 0.1 < angle < 3.1:
        assert np.array(full) == pytest.approx(angle * axis, abs=1e-7)
        assert np.array(tilt) == pytest.approx(angle * axis[:2], abs=1e-7)
    if angle == np.pi:
        assert np.linalg.norm(tilt) > 3.0
