"""The lists of kinds that compiled loops choose from are those of the registries; what is unknown is nan."""

import math

import numpy as np
import pytest

from flyball import forces
from flyball.compiler.formulas import dispatch_by_kind
from flyball.constraints.registry import KINDS, RARE, Kind, no_inputs, ordered
from flyball.engine import element_dispatch
from flyball.model.force import CoordinateForce, TwoFrameForce
from flyball.testing.formula_checks import frame_record, random_motion
from tests.contract.test_forces import LAWS, full

UNKNOWN = 1000
NO_SPLINES = np.zeros(0)


def frames():
    F, M = random_motion(3)
    return frame_record(F), frame_record(M)


@pytest.mark.parametrize(
    "kind", [k for k in forces.ALL if not k.takes_splines and k is not forces.Tyre], ids=lambda k: k.__name__
)
def test_every_force_is_answered_by_its_own_formula(kind):
    par = full(kind)
    if issubclass(kind, CoordinateForce):
        told = par, 0.7, 0.3, LAWS, 2.0
        assert element_dispatch.effort(kind.kind, *told) == kind.effort(*told)
        return
    F, M = frames()
    assert element_dispatch.inputs(kind.kind, par, F, M) == kind.inputs(par, F, M)
    told = par, F, M, LAWS, kind.inputs(par, F, M)
    assert element_dispatch.wrench(kind.kind, *told, NO_SPLINES) == kind.wrench(*told)


def test_no_unknown_kind_is_answered_by_another_ones_formula():
    F, M = frames()
    par = (1.0,) * 16
    none = element_dispatch.wrench_and_rates(UNKNOWN, par, F, M, (0.0, 0.0), np.zeros(3), np.zeros(3))
    assert all(math.isnan(x) for part in none for x in part)
    wrench = element_dispatch.wrench(UNKNOWN, par, F, M, LAWS, (0.1, 0.2), NO_SPLINES)
    inputs = element_dispatch.inputs(UNKNOWN, par, F, M)
    row = element_dispatch.rare(UNKNOWN, par[:8], F, M, 0.0, np.zeros(3))
    numbers = [*wrench[0], *wrench[1], *inputs, row[0], *row[1], *row[2], *row[3], row[4]]
    assert all(math.isnan(x) for x in [*numbers, element_dispatch.effort(UNKNOWN, par, 0.7, 0.3, LAWS, 2.0)])


def test_two_forces_of_one_kind_are_refused():
    class Twin(forces.Rope):
        """Another formula under the rope's number."""

        effort = staticmethod(lambda par, x, rate, laws, load: 0.0)

    free = 1 + max(c.kind for c in (*forces.ALL, *forces.LIMITS) if hasattr(c, "kind"))
    taken = rf"kind {forces.Rope.kind} is taken twice.*rope.*test_dispatch; the next free is {free}"
    with pytest.raises(RuntimeError, match=taken):
        forces.formulas([*forces.ALL, Twin], "effort")


def test_a_formula_without_its_decorator_is_refused_by_name():
    with pytest.raises(
        RuntimeError, match=r"cannot call tests\.contract\.test_dispatch\.a_row: put the decorator @formula"
    ):
        dispatch_by_kind(__name__, "row", "par, F, M, hint, data", {0: a_row}, "nan")


def test_the_zeros_of_a_base_class_are_a_formula():
    """A force of the package may inherit them."""
    assert TwoFrameForce.inputs is no_inputs
    assert dispatch_by_kind(__name__, "some_inputs", "par, F, M", {0: no_inputs}, "nan")(0, (), *frames()) == (0.0, 0.0)


def a_row(par, F, M, hint, data):
    raise NotImplementedError


def test_kinds_of_rows_are_numbered_without_gaps_and_frequent_ones_first():
    n = len(KINDS)
    with pytest.raises(
        RuntimeError, match=rf"KIND 3 is taken twice: by flyball\.constraints\.distance and.*; the next free is {n}"
    ):
        ordered([*KINDS, Kind(3, a_row)])
    with pytest.raises(RuntimeError, match="must be 0, 1, 2"):
        ordered([*KINDS, Kind(n + 1, a_row)])
    with pytest.raises(RuntimeError, match="OFTEN is for the first kinds"):
        ordered([*KINDS, Kind(n, a_row, often=True)])
    assert [k.often for k in KINDS] == [True] * RARE + [False] * (n - RARE)
