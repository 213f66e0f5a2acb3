"""What is compiled our way does what Python does: loops over ranges, errors of callees, tuples, variables of branches."""

import pytest
from numba import njit
from numba.extending import register_jitable

from flyball.compiler import ways


@register_jitable
def refused(x):
    if x < 0.0:
        raise ValueError("below zero")
    return x


@register_jitable
def handed_on(x):
    return refused(x) + 1.0


@register_jitable
def turned(pair, swap):
    a, b = pair
    if swap:
        pair = (b, a)
    return pair


def lean_counts(n, m, step):
    total, last = 0, -1
    for i in range(n):
        last = i
        for j in range(i - 1, m):
            if j == 3:
                continue
            total = 3 * total + j
            if abs(total) > 10**6:
                break
    for k in range(m, n, step):
        total += 7 * k
    return total, last


def lean_errors(x):
    return handed_on(x)


def lean_tuples(a, b, swap):
    c = complex(a, b)
    d = -c * c + a - c
    first, second = turned((a, b), swap)
    y = 0.0
    if swap:
        y = first
    return first - second + y, d.real, d.imag


def compiled(function):
    made = njit(function)

    def run(*args):
        with ways.optimise_once(function.__qualname__):
            return made(*args)

    return run


def test_ranges_count_as_in_python():
    made = compiled(lean_counts)
    for args in [(0, 5, 1), (4, 5, -1), (3, -2, 1), (5, 2, 2), (-3, 4, -2), (6, 6, -1)]:
        assert made(*args) == lean_counts(*args)


def test_an_error_of_a_callee_is_one_of_the_caller():
    made = compiled(lean_errors)
    assert made(2.0) == 3.0
    with pytest.raises(ValueError, match="below zero"):
        made(-2.0)


def test_tuples_and_complex_numbers():
    made = compiled(lean_tuples)
    for args in [(2.0, 3.0, True), (2.0, 3.0, False), (-0.5, 0.25, True)]:
        assert made(*args) == lean_tuples(*args)
