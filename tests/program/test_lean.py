"""What is compiled our way does what Python does: loops over ranges, errors of callees, tuples, variables of branches."""

import numpy as np
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


def formula(function):
    """As formulas of ours are called: by their module."""
    function.__module__ = "flyball.sample"
    return register_jitable(error_model="numpy", _nrt=False, no_cfunc_wrapper=True)(function)


@formula
def picked(record, k, turn):
    """Of a record some members are used, one by its number, and one is handed on."""
    (a, b), rest, c = record
    if turn:
        c = rest[1]
    return a + rest[k], within(rest, k) * c


@formula
def within(rest, k):
    if k > 2:
        raise ValueError("beyond")
    total = 0.0
    for i in range(2, -1, -1):
        total = 2.0 * total + rest[i] * (0.5, 0.25, 2.0)[i]
    return total + rest[k - 3]


@formula
def divided(a, b):
    return a / b


def lean_records(x, n, turn):
    total = 0.0
    for k in range(0, n, 2):
        y = x * k
        record = ((x, y), (1.0, y, x), 3.0)
        a, b = picked(record, k, turn)
        c, d = picked(((b, a), record[1], a), 0, not turn)
        total = total - a + b * c - d
    return total


def lean_quotients(a, b):
    return divided(a, b), divided(a.imag, b), divided(a, b.real)


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
    for k in range(n, m, -1):
        total -= 5 * k
    for k in range(m, n, 3):
        total += 11 * k * k
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


def test_members_of_records_are_what_they_are_in_python():
    made = compiled(lean_records)
    for args in [(2.0, 3, True), (-1.5, 3, False), (0.25, 1, True)]:
        assert made(*args) == lean_records(*args)
    with pytest.raises(ValueError, match="beyond"):
        made(2.0, 5, True)


def test_what_was_compiled_our_way_is_called_by_what_is_not():
    """The same function, already compiled, from a caller that Numba compiles in its own way."""
    compiled(lean_records)(2.0, 3, True)
    usual = njit(lean_records)
    assert usual(2.0, 3, False) == lean_records(2.0, 3, False)
    with pytest.raises(ValueError, match="beyond"):
        usual(2.0, 5, True)


def test_quotients_of_complex_numbers_are_those_of_python():
    made = compiled(lean_quotients)
    for args in [(3 - 2j, 1 + 4j), (1e-40j + 2.0, 3.0 + 1e-40j), (-1e200 + 1e200j, -1e200 - 1e180j)]:
        assert made(*args) == lean_quotients(*args)
    assert np.isnan(made(1j + 1.0, 0j)[0])
