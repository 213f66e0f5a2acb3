"""Ranges of laws over intervals hold all their values and slopes there; all changes of sign are found."""

from __future__ import annotations

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from flyball.laws.breakpoints import find_breakpoints, sign_changes, time_dependent_laws
from flyball.laws.interval_evaluation import IntervalLaw, read_steps
from tests.laws.written import program, values

SMOOTH = ["sin", "cos", "exp", "tanh", "atan", "sinh", "cosh", "sqrt", "log", "asin", "acos", "tan", "bow"]
BENT = ["abs", "sign", "saw", "rise"]


def laws(functions, poles=True):
    number = st.integers(-300, 300).map(lambda x: f"({x / 100})")
    leaf = st.one_of(st.just("t"), st.just("t"), number)

    def more(inner):
        return st.one_of(
            st.tuples(st.sampled_from(functions), inner).map(lambda x: f"{x[0]}({x[1]})"),
            st.tuples(inner, st.sampled_from(["+", "-", "*", *("/" * poles)]), inner).map(
                lambda x: f"({x[0]} {x[1]} {x[2]})"
            ),
            st.tuples(inner, st.sampled_from([2, *(-1, 3, 10) * poles])).map(lambda x: f"({x[0]})**({x[1]})"),
            st.tuples(inner, inner).map(lambda x: f"atan2({x[0]}, {x[1]})"),
        )

    return st.recursive(leaf, more, max_leaves=6).filter(lambda x: "t" in x.replace("tan", "").replace("rt", ""))


def compiled(text):
    try:
        return program(text)
    except ValueError:
        return None


@settings(max_examples=250, deadline=None)
@example("((t * (0.0)))**(-1)", -0.001, 1.0)  # -0.0 and 0.0 have reciprocals of opposite signs
@example("sin(((t)**(-1))**(10))", 0.001, 1.0)  # rounding of 1e30 is many turns
@example("tan(atan2((0.01), t))", -0.5, 1.0)  # a tangent of pi / 2 within rounding
@example("tan(atan2((t)**(-1), t))", 0.001, 1.0)  # near a pole, not at it
@example("atan2((t * (0.0)), (-0.01))", -0.001, 1.0)  # -pi of -0.0, pi of 0.0
@given(laws(SMOOTH), st.integers(-4000, 4000).map(lambda x: x / 1000), st.floats(1e-6, 2))
def test_ranges_hold_values_and_slopes(text, start, width):
    made = compiled(text)
    if made is None:
        return
    code, const, at = made
    steps = read_steps(code, at)
    with np.errstate(all="ignore"):
        law = IntervalLaw(steps, const)
        (lo, hi), (down, up) = law.enclose(range(len(steps)), (np.array([start]), np.array([start + width])), {})[
            len(steps) - 1
        ]
        t = start + width * np.linspace(0, 1, 257)
        f, slope = (np.broadcast_to(x[len(steps) - 1], t.shape) for x in law.points(range(len(steps)), t))
        told = values(text, t)
        rounding = 1e-13 * np.abs(t * slope)  # of t, carried through the law: all that sin(t**-10) near 0 leaves
        wrong = np.abs(f - told) > 1e-6 * np.abs(told) + rounding + 1e-12
    assert (np.isfinite(f) == np.isfinite(told)).all()
    fine = np.isfinite(f) & np.isfinite(slope)  # not at single points such as atan2(0, 0)
    assert not wrong[fine].any()
    near = 1e-9 * (1.0 + np.abs(f)) + rounding
    assert (f >= lo - near)[fine].all() and (f <= hi + near)[fine].all()
    with np.errstate(over="ignore"):
        near = 1e-7 * (1.0 + np.abs(slope)) + 1e-13 * slope**2
    assert (slope >= down - near)[fine].all() and (slope <= up + near)[fine].all()


@settings(max_examples=150, deadline=None)
@example("saw((sin(t) + sin(t)))")  # touches zero in the middle between two corners
@given(laws(["sin", "cos", "tanh", "abs", "sign", "saw", "rise", "bow"]))
def test_no_change_of_sign_is_missed(text):
    made = compiled(text)
    if made is None:
        return
    code, const, at = made
    if read_steps(code, at)[-1].on == 0:
        return
    times, up, complete = sign_changes(code, const, at, 0.0, 3.0)
    if not complete:
        return
    t = np.linspace(0.0, 3.0, 3001) + 1e-4
    f = values(text, t)
    size = np.nanmax(np.abs(np.where(np.isfinite(f), f, 0.0)))
    clear = np.isfinite(f) & (np.abs(f) > 1e-9 * size) & (t < 3.0)
    k = np.searchsorted(times, t[clear])
    if len(times):
        sign = np.where(k > 0, up[np.maximum(k - 1, 0)], ~up[0])
        assert (sign == (f[clear] > 0.0)).all()
    elif clear.any():
        assert (f[clear] > 0.0).all() or (f[clear] < 0.0).all()


@settings(max_examples=100, deadline=None)
@given(laws([*BENT, "sin", "tanh"], poles=False))
def test_between_breaks_laws_are_smooth(text):
    """Where the fourth difference of a law is more than rounding there is a break."""
    made = compiled(text)
    if made is None:
        return
    code, const, at = made
    b = find_breakpoints(time_dependent_laws(code, [at]), const, 0.0, 3.0)
    if b.given_up:
        return
    h = 1e-5
    t = np.linspace(0.011, 2.989, 2000)
    f, bent = fourth_difference(text, t, h)
    with np.errstate(all="ignore"):
        size = np.nanmax(np.where(np.isfinite(f), np.abs(f), 0.0))
        kinks = np.flatnonzero(np.isfinite(bent) & (bent > 1e-3 * h * size) & (np.abs(f) < 1e3))
    edges = np.r_[0.0, b.times, 3.0]
    for k in kinks:  # of a law that only bends quickly it is 4096 times smaller in steps of h / 8
        finer = np.nanmax(fourth_difference(text, t[k] + h * np.linspace(-2, 2, 65), h / 8)[1])
        assert np.abs(edges - t[k]).min() <= 4 * h or finer < bent[k] / 64


def fourth_difference(text, t, h):
    """Values of a law, and sizes of its fourth differences in steps of h."""
    f = [values(text, t + n * h) for n in (-2, -1, 0, 1, 2)]
    with np.errstate(all="ignore"):
        return f[2], np.abs(f[0] - 4 * f[1] + 6 * f[2] - 4 * f[3] + f[4])
