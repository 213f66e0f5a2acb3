"""Equilibria and eigenvalues over a parameter, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flyball as fb

K = 2.0  # N m


def lever(**parameters: float) -> fb.Mechanism:
    """A horizontal rod, 1 m, on a hinge with a torsional spring; a load hangs on its tip."""
    m = fb.Mechanism("lever", planar=True, parameters={"P": 0.0, "k": K} | parameters)
    m.add(fb.Body("rod", mass=1, inertia=1, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "A.angle", stiffness="k"))
    m.add(fb.PointForce("load", "rod", at=(1, 0), force=(0, "-P")))
    return m


def column(torque: float = 0.0) -> fb.Mechanism:
    """The lever standing up, its load along it: it buckles at P l = k."""
    m = fb.Mechanism("column", planar=True, parameters={"P": 0.0, "T": torque})
    m.add(fb.Body("rod", mass=1, inertia=1, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "A.angle", stiffness=K), fb.Motor("bias", "A", torque="T"))
    m.add(fb.PointForce("load", "rod", at=(0, 1), force=(0, "-P")))
    return m


RISE, STIFFNESS = 0.3, 1000.0
BAR = math.hypot(1.0, RISE)


def truss() -> fb.Mechanism:
    """Von Mises' truss: two bars that are springs, 2 m apart at their feet, loaded at the tip."""
    m = fb.Mechanism("truss", planar=True, parameters={"P": 0.0})
    m.add(fb.Body("tip", mass=1, inertia=1, position=(0, RISE)))
    m.add(fb.Translational("guide", "ground", "tip", at=(0, RISE), axis=(0, 1)))
    for name, x in (("left", -1.0), ("right", 1.0)):
        m.add(fb.SpringDamper(name, "ground", "tip", at=((x, 0), (0, RISE)), stiffness=STIFFNESS))
    m.add(fb.PointForce("load", "tip", force=(0, "-P")))
    return m


def carried(y: float) -> float:
    """Load of the truss in equilibrium with its tip at height y."""
    return 2 * STIFFNESS * y * (BAR / math.hypot(1.0, y) - 1.0)


# dP/dy = 0 where the bars' length cubed is their free length times the half span squared
Y_LIMIT = math.sqrt(BAR ** (2 / 3) - 1.0)
P_LIMIT = carried(Y_LIMIT)


def test_a_lever_under_growing_load() -> None:
    """k theta = P cos theta."""
    loads = np.linspace(0, 30, 7)
    series = lever().equilibria("P", loads)
    exact = [brentq(lambda x, P=P: K * x - P * math.cos(x), 0, math.pi / 2, xtol=1e-15) for P in loads]
    assert series["A.angle"] == pytest.approx(-np.array(exact), abs=1e-8)
    assert series["rod.y"] == pytest.approx(-0.5 * np.sin(exact), abs=1e-8)
    assert set(series.stability) == {"stable"}
    assert series.jumps == []
    assert len(series) == 7
    assert series[3].parameters["P"] == 15.0


def test_a_truss_snaps_through_at_its_limit_load() -> None:
    loads = np.r_[np.linspace(0, 1.3, 9), np.linspace(1.2, -1.3, 14)] * P_LIMIT
    series = truss().equilibria("P", loads)
    down, up = series.jumps
    assert down.value == pytest.approx(P_LIMIT, rel=1e-4)
    assert up.value == pytest.approx(-P_LIMIT, rel=1e-4)
    assert down.value >= P_LIMIT * (1 - 1e-9)  # it cannot be carried any further
    assert down.before["tip.y"] == pytest.approx(Y_LIMIT, abs=3e-3)  # of the order of the square root of what is left
    assert [carried(y) for y in series["tip.y"]] == pytest.approx(loads, abs=1e-6 * P_LIMIT)
    snapped = np.zeros(len(loads), bool)
    snapped[np.flatnonzero(loads > P_LIMIT)[0] : np.flatnonzero(loads < -P_LIMIT)[0]] = True
    assert (series["tip.y"] < 0).tolist() == snapped.tolist()
    assert "the branch ends" in str(series)


def test_a_column_is_followed_on_or_left_where_it_buckles() -> None:
    loads = np.linspace(0.5, 4.5, 5)
    upright = column().equilibria("P", loads)
    assert upright["A.angle"] == pytest.approx(0.0, abs=1e-12)
    assert upright.stability == ("stable", "stable", "unstable", "unstable", "unstable")
    assert upright.jumps == []
    left = column().equilibria("P", loads, stable=True)
    assert set(left.stability) == {"stable"}
    exact = [0.0, 0.0] + [brentq(lambda x, P=P: K * x - P * math.sin(x), 0.1, 3.1) for P in loads[2:]]
    assert np.abs(left["A.angle"]) == pytest.approx(exact, abs=1e-8)
    assert len(left.jumps) == 1
    assert left.jumps[0].before.stability == "unstable"
    assert "becomes unstable" in str(left)


def test_an_imperfect_column_bends_without_a_jump() -> None:
    """k theta = P sin theta + T: followed however steep it becomes."""
    loads = np.linspace(0, 5, 5)
    series = column(torque=0.05).equilibria("P", loads, start=column(0.05).equilibrium(parameters={"P": 0.0}))
    exact = [brentq(lambda x, P=P: K * x - P * math.sin(x) - 0.05, 0, 3.1) for P in loads]
    assert series["A.angle"] == pytest.approx(exact, abs=1e-8)
    assert series.jumps == []


def test_time_as_the_parameter() -> None:
    """A driver turns the first of two rods; the second hangs from it, whatever the first does."""
    m = fb.Mechanism("held", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("arm", mass=1, inertia=1, position=(0.5, 0)), fb.Body("rod", mass=1, inertia=1, position=(1, -0.5)))
    m.add(fb.Revolute("A", "ground", "arm", at=(0, 0)), fb.Revolute("B", "arm", "rod", at=(1, 0)))
    m.add(fb.Driver("turn", "A.angle", "0.5*t"))
    series = m.equilibria("t", [0.0, 1.0, 2.0, 3.0])
    assert series["A.angle"] == pytest.approx([0.0, 0.5, 1.0, 1.5])
    assert series["rod.angle"] == pytest.approx(0.0, abs=1e-9)
    assert series["B.angle"] == pytest.approx([0.0, -0.5, -1.0, -1.5])
    torque = [(9.81 * 0.5 + 9.81) * math.cos(x) for x in (0.0, 0.5, 1.0, 1.5)]
    assert series["turn.effort"] == pytest.approx(torque)


def test_where_nothing_holds_any_more_the_error_says_what_was_reached() -> None:
    """A motor lifts a hanging rod: beyond m g l / 2 nothing balances it."""
    m = fb.Mechanism("lifted", planar=True, gravity=(0, -9.81), parameters={"T": 0.0})
    m.add(fb.Body("rod", mass=1, inertia=1, position=(0, -0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", "A", torque="T"))
    with pytest.raises(fb.NotConverged) as caught:
        m.equilibria("T", [0.0, 2.0, 4.0, 6.0])
    error = caught.value
    assert "stops at T = 6; the last of 3 reached is T = 4" in str(error)
    assert "no equilibrium of 'lifted'" in str(error)
    assert error.series["A.angle"] == pytest.approx(np.arcsin([0.0, 2.0 / 4.905, 4.0 / 4.905]))
    assert error.residuals


@pytest.mark.parametrize(
    ("parameter", "values", "said"),
    [
        ("p", [1.0], r"'lever' has no parameter 'p' \(did you mean 'P'\?\)"),
        ("P", [], "must be finite numbers in SI units"),
        ("P", [1.0, math.nan], "values are finite numbers"),
    ],
)
def test_wrong_parameters(parameter: str, values: list[float], said: str) -> None:
    for ask in (lever().equilibria, lever().root_locus):
        with pytest.raises(fb.ModelError, match=said):
            ask(parameter, values)


def test_series_as_data_and_as_a_picture(tmp_path: Path) -> None:
    series = column().equilibria("P", np.linspace(0.5, 4.5, 5), stable=True)
    data = series.as_dict()
    assert data["values"] == series.values.tolist()
    assert data["equilibria"][4]["values"]["A.angle"]["value"] == series["A.angle"][4]
    assert len(data["jumps"]) == 1
    figure = series.plot("A.angle", "rod.x")
    assert [ax.get_ylabel() for ax in figure.axes] == ["angle [rad]", "length [m]"]
    labels = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert labels == ["A.angle", "unstable", "jump"]
    dashed = [line for line in figure.axes[0].lines if line.get_linestyle() == "--" and len(line.get_xdata()) > 2]
    assert [np.nanmin(line.get_xdata()) for line in dashed] == [1.5]  # from the last stable one on
    series.plot(path=tmp_path / "series.png")
    assert (tmp_path / "series.png").stat().st_size > 10_000
    with pytest.raises(fb.ModelError, match="no part named"):
        series.plot("C.angle")


def test_soft_directions_beside_stiff_ones_are_followed_to_their_end() -> None:
    """The governor, not turning: its balls fall by a right angle, then its slider hangs from two stiff springs."""
    m = fb.load(Path(__file__).parents[2] / "examples" / "governor.toml")
    x = m.equilibrium()
    weight = 3000 * 0.1**3 * 9.81
    assert x["slider.z"] == pytest.approx(-weight / (2 * 8e5), rel=1e-6)
    assert x.stability == "marginal"  # it can be turned


def oscillator() -> fb.Mechanism:
    m = fb.Mechanism("oscillator", planar=True, parameters={"c": 0.0, "k": 50.0})
    m.add(fb.Body("A", mass=2, inertia=1, position=(1, 0)))
    m.add(fb.Translational("P", "ground", "A", at=(1, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("s", "ground", "A", at=((0, 0), (1, 0)), stiffness="k", damping="c"))
    return m


def test_eigenvalues_over_damping() -> None:
    """m s^2 + c s + k = 0; critical at c = 2 sqrt(k m) = 20."""
    c = np.linspace(0, 40, 21)
    locus = oscillator().root_locus("c", c)
    root = np.sqrt((c / 4) ** 2 - 25.0 + 0j)
    exact = np.stack([-c / 4 - root, -c / 4 + root], axis=1)
    assert np.sort_complex(locus.eigenvalues) == pytest.approx(np.sort_complex(exact), abs=1e-6)
    apart = np.abs(np.diff(locus.eigenvalues, axis=0)).max(axis=1)
    swapped = np.abs(locus.eigenvalues[1:, ::-1] - locus.eigenvalues[:-1]).max(axis=1)
    assert np.all(apart <= swapped + 1e-9)
    assert locus.crossings == []
    assert locus.unstable.tolist() == [0] * 21


def test_where_stability_changes_is_found_exactly() -> None:
    """A standing rod held by a spring: stable from k = m g l / 2 on."""
    m = fb.Mechanism("standing", planar=True, gravity=(0, -9.81), parameters={"k": 0.0})
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("s", "A.angle", stiffness="k", damping=0.5))
    locus = m.root_locus("k", np.linspace(0, 10, 6))
    ((value, eigenvalue, kind, change),) = locus.crossings
    assert (kind, change) == ("divergence", -1)
    assert value == pytest.approx(4.905, rel=1e-9)
    assert eigenvalue == pytest.approx(0.0, abs=1e-9)
    assert locus.unstable.tolist() == [1, 1, 1, 0, 0, 0]
    assert "k = 4.905" in str(locus)
    assert "k = 4.905" in [t.get_text() for t in locus.plot().axes[0].texts]
    assert locus.as_dict()["crossings"][0]["value"] == value


def test_eigenvalues_about_the_equilibrium_at_each_value() -> None:
    """The loaded lever: I theta'' = -(k + P sin theta) theta about k theta = P cos theta; I = 1 + 1/4 kg m^2."""
    loads = np.linspace(0, 10, 5)
    locus = lever().root_locus("P", loads, equilibrium=True)
    rest = [brentq(lambda x, P=P: K * x - P * math.cos(x), 0, math.pi / 2, xtol=1e-15) for P in loads]
    omega = [math.sqrt((K + P * math.sin(x)) / 1.25) for P, x in zip(loads, rest, strict=True)]
    assert locus.eigenvalues[:, 1].imag == pytest.approx(omega, rel=1e-7)
    assert locus.eigenvalues.real == pytest.approx(0.0, abs=1e-6)


def test_a_locus_that_stops_keeps_what_it_has() -> None:
    """As described the lever is in equilibrium without a load only."""
    with pytest.raises(
        fb.NotConverged, match=r"stops at P = 1; the last of 1 reached is P = 0\..*equilibrium"
    ) as caught:
        lever().root_locus("P", [0.0, 1.0])
    assert caught.value.series.eigenvalues.shape == (1, 2)
    with pytest.raises(fb.ModelError, match="give equilibrium=True"):
        lever().root_locus("P", [0.0, 1.0], about=lever().equilibrium())
