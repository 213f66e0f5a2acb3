"""Corners and brief actions of laws of time are found before a motion: against what is known of each law."""

from __future__ import annotations

import numpy as np
import pytest

from flyball.laws.breakpoints import acts_briefly, find_breakpoints, sign_changes, time_dependent_laws
from tests.laws.written import program


def sharp(text: str, t0: float = 0.0, t1: float = 10.0) -> np.ndarray:
    code, const, at = program(text)
    b = find_breakpoints(time_dependent_laws(code, [at]), const, t0, t1)
    assert not b.given_up
    return b.times[
        b.sharp & (b.times > t0 + 1e-9) & (b.times < t1 - 1e-9)
    ]  # what is at the ends themselves stands beside


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("abs(t - 5)", [5.0]),
        ("where(t < 3.3, 0, where(t < 3.301, 1000, 0))", [3.3, 3.301]),
        ("max(0, 2000 - 2e6*abs(t - 3.3))", [3.299, 3.3, 3.301]),
        ("blow(t)", [3.3, 3.3005, 3.301]),
        ("step(t, 1, 0, 2, 5) + sin(t)", [1.0, 2.0]),
        ("sign(sin(2*pi*200*t))", np.arange(1, 4000) / 400),
        (
            "where(sin(2*pi*200*t) > 0.5, value, 0)",
            np.sort(np.r_[np.arange(2000) + 1 / 12, np.arange(2000) + 5 / 12]) / 200,
        ),
        ("saw(7*t)", np.sort(np.r_[np.arange(1, 70), np.arange(70) + 0.3]) / 7),
        ("atan2(sin(5*t), cos(5*t))", (2 * np.arange(16) + 1) * np.pi / 5),
        ("atan(tan(3*t))", (2 * np.arange(10) + 1) * np.pi / 6),
        ("asin(sin(3*t))", (2 * np.arange(10) + 1) * np.pi / 6),
        ("sqrt((t - 3)**2)", [3.0]),
        ("where((t - 5)**2 < 1e-14, 1, 0)", [5 - 1e-7, 5 + 1e-7]),
        ("where(t > 2 and t < 2.000001, 1, 0)", [2.0, 2.000001]),
        ("abs(abs(t - 4) - 1)", [3.0, 4.0, 5.0]),
        ("where(sin(1/(0.1 + t)) > 0, 1, 0)", 1 / (np.pi * np.array([3, 2, 1])) - 0.1),
        ("rise(t)", [0.5, 2.0, 4.0]),
        ("max(0, sin(t) - 1)", []),
        ("t**2*sin(3*t) + value*rate", []),
        ("bow(t) + exp(-t)", [4.0]),
    ],
)
def test_corners(law, expected):
    expected = np.array([t for t in expected if 0.0 < t < 10.0])
    found = sharp(law)
    if "atan2" in law:  # zero of the sine at which the cosine is positive may be there too, and does no harm
        found = np.array([t for t in found if np.abs(expected - t).min() < 0.1])
    assert found == pytest.approx(expected, rel=2e-9 if "asin" in law or "sqrt" in law else 1e-14, abs=1e-15)


@pytest.mark.parametrize("width", [0.3, 1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("centre", [5.0, 1.23456, 9.9, 0.01])
@pytest.mark.parametrize("form", ["exp(-((t - {c})/{w})**2/2)", "1/(1 + ((t - {c})/{w})**2)", "tanh((t - {c})/{w})"])
def test_brief_actions(form, centre, width):
    """Steps that end at breaks: the interval about the centre is a few widths long, or the action is no brief one."""
    code, const, at = program(form.format(c=centre, w=width))
    b = find_breakpoints(time_dependent_laws(code, [at]), const, 0.0, 10.0)
    assert not b.given_up and not b.sharp.any() and len(b.times) < 60
    edges = np.r_[0.0, b.times, 10.0]
    k = np.searchsorted(edges, centre)
    inside = edges[min(k + (edges[k] == centre), len(edges) - 1)] - edges[k - 1]
    assert inside < 40.0 * width
    # and intervals grow from there as they go away, so that none is passed over
    widths = np.diff(edges)
    assert (widths <= 200.0 * np.maximum(np.abs(edges[1:] - centre), width)).all()


def test_what_lasts_long_needs_no_breaks():
    for law in ["exp(-t)", "exp(3*sin(2*pi*t))", "tanh(sin(t))", "bow(0.4*t)**2"]:
        code, const, at = program(law)
        assert len(find_breakpoints(time_dependent_laws(code, [at]), const, 0.0, 10.0).times) <= 3


def test_what_cannot_be_found_is_told():
    """A law with more corners than anyone wants, and one with corners that heap up at one place."""
    for law in ["sign(sin(1e6*t))", "sign(sin(1/(t - 5)))"]:
        code, const, at = program(law)
        assert find_breakpoints(time_dependent_laws(code, [at]), const, 0.0, 10.0).given_up == (at,)


def test_the_state_is_left_to_samples():
    for law, state in [("exp(-value**2)", True), ("value*exp(-t**2)", False), ("where(rate > 0, 1, 0)*t", True)]:
        code, _, at = program(law)
        assert acts_briefly(code, at) == state


def test_signs_of_a_law_of_time():
    code, const, at = program("sin(2*pi*200*t) - 0.1")
    times, up, complete = sign_changes(code, const, at, 0.0, 1.0)
    first = np.arcsin(0.1) / (2 * np.pi)
    expected = np.sort(np.r_[np.arange(200) + first, np.arange(200) + 0.5 - first]) / 200
    assert complete and times == pytest.approx(expected, rel=1e-13)
    assert (up == (np.arange(400) % 2 == 0)).all()
    with pytest.raises(ValueError, match="more than time"):
        sign_changes(*program("value - t"), 0.0, 1.0)


def test_zero_at_a_place_where_an_interval_is_cut():
    """A table passes zero at its break 0.5; t^3 is 0.5 at the middle of the time up to where the table ends."""
    code, const, at = program("bow(t**3)")
    times, up, complete = sign_changes(code, const, at, 0.0, 3.0)
    assert complete and times[0] == pytest.approx(0.5 ** (1 / 3), abs=1e-14) and up[0]
