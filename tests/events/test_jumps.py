"""Velocities that jump, against closed forms, in both coordinate layers."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.constraints.switches.stop import STOP
from flyball.constraints.switches.switch_kind import HELD
from flyball.simulation.events.resolution import resolve_start
from tests.events.one_row import BOTH, Row, forgotten, rows
from tests.events.standing import kicked, modes, moving, standing

__all__ = ["forgotten"]


def rods(ground=False):
    """Two uniform rods of mass 1 and length 2 in line, hinged at the origin; free, or the first one hinged at (-2, 0)."""
    m = fb.Mechanism("rods", planar=True)
    m.add(
        fb.Body("a", mass=1.0, inertia=1 / 3, position=(-1.0, 0)),
        fb.Body("b", mass=1.0, inertia=1 / 3, position=(1.0, 0)),
    )
    m.add(fb.Revolute("B", "a", "b", at=(0, 0)))
    if ground:
        m.add(fb.Revolute("A", "ground", "a", at=(-2, 0)))
    return m


@BOTH
def test_blow_on_the_end_of_two_hinged_rods(coordinates):
    """P across at the free end of the first: u = 5 P / 4 m, w = -9 P / 4 m a; -P / 4 m, 3 P / 4 m a, half length a = 1."""
    m = rows(rods(), Row("far", of=("B.angle",), kind=STOP, par=(-1.0, 1.0)))
    here = standing(m, coordinates)
    here.external_impulse = kicked(here, "a", (-2.0, 0.0), (0.0, 2.0))
    resolve_start(here)
    now = moving(here)
    np.testing.assert_allclose(now["a"], [0.0, 2.5, -4.5], atol=1e-14)
    np.testing.assert_allclose(now["b"], [0.0, -0.5, 1.5], atol=1e-14)
    assert here.given == pytest.approx(0.5 * (2.5**2 + 0.5**2) + (4.5**2 + 1.5**2) / 6, rel=1e-13)
    assert here.lost == 0.0


@BOTH
def test_hinge_that_locks(coordinates):
    """Both go on as one: momentum and angular momentum of the two are kept."""
    m = rows(rods(), Row("lock", of=("B.angle",)))
    here = standing(m, coordinates)
    here.external_impulse = kicked(here, "a", (-2.0, 0.0), (0.0, 2.0))
    here.c.work.modes.mode[0] = HELD
    resolve_start(here)
    w = -2.0 * 2.0 / (2 / 3 + 2.0)  # about the middle: r x P over the inertia of a rod of length 4 and mass 2
    now = moving(here)
    np.testing.assert_allclose(now["a"], [0.0, 1.0 - w, w], atol=1e-14)
    np.testing.assert_allclose(now["b"], [0.0, 1.0 + w, w], atol=1e-14)
    assert modes(here) == [HELD]


def turning(speed_a, speed_b):
    """Two rods hinged to ground in line along x, turning by these speeds."""
    m = fb.Mechanism("double", planar=True)
    m.add(fb.Body("a", mass=1.0, inertia=1 / 3, position=(-1.0, 0), velocity=(0, speed_a), angular_velocity=speed_a))
    m.add(
        fb.Body(
            "b",
            mass=1.0,
            inertia=1 / 3,
            position=(1.0, 0),
            velocity=(0, 2 * speed_a + speed_b),
            angular_velocity=speed_b,
        )
    )
    m.add(fb.Revolute("A", "ground", "a", at=(-2, 0)), fb.Revolute("B", "a", "b", at=(0, 0)))
    return m


@BOTH
def test_sudden_stop_of_a_double_rod(coordinates):
    """The first hinge stops dead: the second rod keeps its angular momentum about its hinge, w' = w_b + 3 v_B / 4 a."""
    m = rows(turning(1.5, -0.5), Row("stop", of=("A.angle",), kind=STOP, par=(-np.inf, 0.0)))
    here = standing(m, coordinates)
    resolve_start(here)
    w = -0.5 + 0.75 * 3.0
    np.testing.assert_allclose(moving(here)["a"], 0.0, atol=1e-14)
    np.testing.assert_allclose(moving(here)["b"], [0.0, w, w], atol=1e-14)
    energy = 0.5 * (1.5**2 * 4 / 3 + 2.5**2 + 0.25 / 3) - w * w * 2 / 3
    assert here.lost == pytest.approx(energy, rel=1e-13)
    (record,) = [r for r in here.records if r.kind == "impact"]
    # angular momentum about A: rod a 4/3 w, rod b 3 v_b + w_b / 3, before and after
    assert record.impulses["stop"] == pytest.approx((3 * w + w / 3) - (2.0 + 7.5 - 0.5 / 3), rel=1e-13)
    assert modes(here) == [HELD] or here.c.work.modes.mode[0] == 0.0


@BOTH
def test_elastic_stop_of_a_double_rod_keeps_the_energy(coordinates):
    m = rows(turning(1.5, -0.5), Row("stop", of=("A.angle",), kind=STOP, par=(-np.inf, 0.0, 1.0)))
    here = standing(m, coordinates)
    resolve_start(here)
    assert here.lost == pytest.approx(0.0, abs=1e-14)
    assert moving(here)["a"][2] == pytest.approx(-1.5, rel=1e-13)


@BOTH
def test_second_hinge_of_a_double_pendulum_locks(coordinates):
    """Angular momentum about the first hinge is kept: (4/3 + 1/3 + 9) w = 4/3 w_a + 3 v_b + w_b / 3."""
    m = rows(turning(1.0, -2.0), Row("lock", of=("B.angle",)))
    here = standing(m, coordinates)
    here.c.work.modes.mode[0] = HELD
    resolve_start(here)
    w = (4 / 3 + 0.0 - 2 / 3) / (4 / 3 + 1 / 3 + 9)
    np.testing.assert_allclose([moving(here)[x][2] for x in "ab"], w, rtol=1e-13)


def cradle(speeds, e):
    """Three sliders in a row that touch."""
    m = fb.Mechanism("cradle", planar=True)
    for i, u in enumerate(speeds):
        m.add(fb.Body(f"b{i}", mass=1.0, inertia=1.0, position=(float(i), 0), velocity=(u, 0)))
        m.add(fb.Prismatic(f"P{i}", "ground", f"b{i}", at=(float(i), 0), axis=(1, 0)))
    for i in range(2):
        of = (f"P{i}.displacement", f"P{i + 1}.displacement")
        rows(m, Row(f"gap{i}", of=of, kind=STOP, par=(0.0, np.inf, e), weights=(-1.0, 1.0)))
    return m


@BOTH
@pytest.mark.parametrize(
    ("e", "after"), [(0.0, (1 / 3, 1 / 3, 1 / 3)), (1.0, (-1 / 3, 2 / 3, 2 / 3)), (0.5, (0.0, 1 / 2, 1 / 2))]
)
def test_three_in_a_row_by_poissons_law(coordinates, e, after):
    """All at once: compression to 1/3 by impulses 2/3 and 1/3, then e times these (Glocker 2001)."""
    here = standing(cradle((1.0, 0.0, 0.0), e), coordinates)
    resolve_start(here)
    np.testing.assert_allclose([moving(here)[f"b{i}"][0] for i in range(3)], after, atol=1e-14)
    assert here.lost == pytest.approx(0.5 - 0.5 * sum(u * u for u in after), abs=1e-14)


def test_driver_that_moves_what_is_to_be_locked_is_told():
    m = fb.Mechanism("driven", planar=True)
    m.add(fb.Body("a", mass=1.0, inertia=1.0), fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Driver("turn", "A.angle", "2 * t"))
    here = standing(rows(m, Row("stop", of=("A.angle",), kind=STOP, par=(-1.0, 0.0))), "absolute")
    with pytest.raises(fb.SimulationError, match="no impulses satisfy all constraints on the velocities") as error:
        resolve_start(here)
    assert "stop" in str(error.value)


@pytest.mark.parametrize("coordinates", ["absolute", "joint"])
def test_driver_gives_what_an_impact_takes(coordinates):
    """A driven carriage at 1 m/s meets a slider at rest, e = 0: impulse m v, of which half is lost and all the driver's."""
    m = fb.Mechanism("pushed", planar=True)
    for i in range(2):
        m.add(fb.Body(f"b{i}", mass=2.0, inertia=1.0, position=(float(i), 0)))
        m.add(fb.Prismatic(f"P{i}", "ground", f"b{i}", at=(float(i), 0), axis=(1, 0)))
    m.add(fb.Driver("go", "P0.displacement", "t"))
    of = ("P0.displacement", "P1.displacement")
    here = standing(rows(m, Row("gap", of=of, kind=STOP, par=(0.0, np.inf, 0.0), weights=(-1.0, 1.0))), coordinates)
    z = here.y[here.structure.nq + here.structure.nv :].copy()
    resolve_start(here)
    assert moving(here)["b1"][0] == pytest.approx(1.0, rel=1e-13)
    assert here.lost == pytest.approx(1.0, rel=1e-13)
    given = here.y[here.structure.nq + here.structure.nv :] - z
    assert given.sum() == pytest.approx(2.0, rel=1e-13)


def test_start_beyond_a_limit_names_it():
    m = rods(ground=True)
    here = standing(rows(m, Row("knee", of=("B.angle",), kind=STOP, par=(0.2, 1.0))), "joint")
    with pytest.raises(
        fb.ModelError, match=r"'knee'.*starts beyond it: B.angle is 0 rad and must be within 0.2 rad .* and 1 rad"
    ):
        resolve_start(here)


@BOTH
def test_what_hinges_carry_in_a_sudden_stop(coordinates):
    """Momentum of the second rod goes through its hinge, that of both through the first one's: the stop is a couple."""
    m = rows(turning(1.5, -0.5), Row("stop", of=("A.angle",), kind=STOP, par=(-np.inf, 0.0)))
    run = m.simulate(0.01, outputs=2, coordinates=coordinates)
    hit, *touched = run.events.of("impact")  # the rods in line press on the stop only once they bend
    assert sum(e.lost for e in touched) < 1e-15
    second = -0.5 + 0.75 * 3.0 - 2.5
    np.testing.assert_allclose(hit.impulses["B"], [0, second, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(hit.impulses["A"], [0, second - 1.5, 0, 0, 0, 0], atol=1e-12)
    assert set(hit.impulses) == {"stop", "A", "B"}
    assert hit.as_dict()["impulses"]["B"][1] == pytest.approx(second)


def falling_bar(tilt):
    """A spatial bar that hangs on a ball joint, with a stop on the height of its free end, which it meets turning."""
    m = fb.Mechanism("bar", gravity=(0, 0, 0))
    m.add(
        fb.Body(
            "bar",
            mass=2.0,
            inertia=(0.1, 2 / 3, 2 / 3),
            position=(1.0, 0, 0),
            velocity=(0, 0.3, -0.7),
            angular_velocity=(0, 0.7, 0.3),
        )
    )
    m.add(fb.Spherical("S", "ground", "bar", at=(0, 0, 0)))
    m.add(fb.Frame("tip", body="bar", position=(1.0, 0.2, 0)))
    return rows(m, Row("stop", of=("tip.z",), kind=STOP, par=(0.0, np.inf, 0.4)))


def test_both_layers_agree_on_impulses_in_space():
    """The joint's impulse by its rows, and by the sweep over jumps of velocities."""
    seen = []
    for coordinates in ("absolute", "joint"):
        run = falling_bar(0.0).simulate(0.01, outputs=2, coordinates=coordinates)
        (hit,) = run.events.of("impact")
        seen.append((hit.impulses["stop"], hit.lost, *hit.impulses["S"], *hit.after["bar.angular_velocity"]))
    np.testing.assert_allclose(seen[0], seen[1], rtol=1e-10, atol=1e-13)
    # e of the closing rate 1.4: the tip leaves with 0.56
    assert seen[0][0] > 0.0 and seen[0][1] > 0.0
