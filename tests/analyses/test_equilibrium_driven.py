"""Fully driven mechanisms at rest: reactions carry all, and there is nothing to give way."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flyball as fb

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVEN = {
    name: fb.load(EXAMPLES / f"{name}.toml")
    for name in ("toggle_press", "slider_crank", "quick_return", "spatial_slider_crank")
}
PARAMETERS = [(name, p) for name, m in DRIVEN.items() for p in m.parameters]


@pytest.fixture(autouse=True)
def no_warnings() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", fb.PerformanceNotice)
        yield


def torque(r: float, rod: float, angle: float) -> float:
    """The motor's torque that holds the example's slider-crank at rest, by virtual work."""

    def energy(a: float) -> float:
        x = r * np.cos(a) + np.sqrt(rod**2 - (r * np.sin(a)) ** 2)
        return 9.81 * (0.5 * 1.0 + 0.5 * 1.5) * r * np.sin(a) + 0.5 * 200.0 * (1.2 - x - 0.5) ** 2

    return (energy(angle + 1e-5) - energy(angle - 1e-5)) / 2e-5


@pytest.mark.parametrize("t", [0.0, 0.3, 1.2])
@pytest.mark.parametrize("name", DRIVEN)
def test_a_driven_mechanism_rests_at_all_times(name: str, t: float) -> None:
    rest = DRIVEN[name].equilibrium(t=t)
    assert rest.stability == "stable"
    assert rest.unbalanced < 1e-9
    assert not rest.freedoms


@pytest.mark.parametrize(("name", "parameter"), PARAMETERS)
def test_it_is_followed_over_every_parameter(name: str, parameter: str) -> None:
    m = DRIVEN[name]
    values = m.environment({})[parameter] * np.array([1.0, 1.02, 1.04])
    series = m.equilibria(parameter, values)
    assert [e.stability for e in series.equilibria] == ["stable"] * 3
    assert not series.jumps


@pytest.mark.parametrize(
    ("parameter", "values"), [("crank", [0.2, 0.21, 0.25]), ("rod", [0.5, 0.51, 0.6]), ("speed", [10.0, 10.2, 12.0])]
)
def test_the_motor_of_a_slider_crank_holds_what_virtual_work_says(parameter: str, values: list[float]) -> None:
    t = 0.3
    series = DRIVEN["slider_crank"].equilibria(parameter, values, t=t)
    given = DRIVEN["slider_crank"].environment({})
    for value, effort in zip(values, series["motor.effort"], strict=True):
        now = given | {parameter: value}
        assert effort == pytest.approx(torque(now["crank"], now["rod"], now["speed"] * t), rel=1e-7)


@pytest.mark.parametrize(("parameter", "values"), [("crank", [0.2, 0.21]), ("rod", [0.5, 0.51])])
def test_a_root_locus_over_driven_equilibria_has_no_roots(parameter: str, values: list[float]) -> None:
    locus = DRIVEN["slider_crank"].root_locus(parameter, values, equilibrium=True, t=0.3)
    assert locus.values == pytest.approx(values)


def test_where_it_cannot_close_the_series_says_so() -> None:
    """A crank that becomes longer than the rod, nearly upright."""
    with pytest.raises(fb.NotConverged, match="leave nothing free, and where the search ended they do not close"):
        DRIVEN["slider_crank"].equilibria("crank", [0.2, 0.6], t=0.157)
