"""Tables of complex parameters: their imaginary parts are the derivatives of the real tables, all of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flyball as fb
from flyball import forces, joints
from flyball.errors import ExpressionError, ModelError
from flyball.model.coupling import Coupling
from flyball.model.geometry import triad
from flyball.model.grammar import FUNCTIONS
from flyball.model.shapes import ALL as SHAPES
from flyball.model.expressions import Expression, number
from flyball.system.coordinates import _least_squares
from flyball.system.inverse import inverse_inertia
from flyball.system.spanning import spanning
from flyball.system.structure import structure
from flyball.system.values import values, work
from tests import mechanisms
from tests.complex_steps import STEP, errors_of, with_parameters
from tests.contract import zoo
from tests.examples.test_examples import FILES
from tests.model.test_shapes import SAMPLES

LAYERS = ("absolute", "joint")
AXES = ("axis", "axes", "normal")  # which axes go with one along a world axis jumps with a change: tested apart
RIGHT_ANGLES = {"Universal": {"axes"}, "WheelOnLine": {"at", "axis", "centre"}}  # allow no change of one number


def structures(m):
    """In absolute coordinates, and in joint coordinates if it has any."""
    tree = spanning(m)
    return [structure(m), *([structure(m, tree=tree)] if tree else [])]


def check_all(m, skipped=(), refused=()):
    """Every number of a mechanism, and every parameter it has."""
    given = m.environment()
    m, names = with_parameters(m)
    for s in structures(m):
        for name, value in given.items():
            assert errors_of(s, name, abs(value) or 0.1) == [], name
        for field, name in names.items():
            if field.partition(".")[2] in skipped:
                continue
            try:
                assert errors_of(s, name, 1.0) == [], field
            except ModelError:
                assert field.partition(".")[2] in refused, field


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_every_joint(where, name):
    check_all(zoo.joined(where, name), refused=RIGHT_ANGLES.get(name, ()))


@pytest.mark.parametrize("name", FILES)
def test_every_parameter_of_the_examples(name):
    m = mechanisms.example(name)
    for s in structures(m):
        for k, value in m.environment().items():
            assert errors_of(s, k, abs(value) or 0.1) == [], k


@pytest.mark.parametrize("name", ["governor.toml", "spatial_slider_crank.toml", "rolling_race.toml", "n_four_bar.py"])
def test_every_number_of_an_example(name):
    """Some numbers allow no change: thin bodies are at the limit of what inertias can be."""
    check_all(mechanisms.example(name), skipped=AXES, refused=("inertia", "inertia_about", "com"))


@pytest.mark.parametrize("made", ["four_bar", "bricard", "door", "hanging_bodies", "free_body"])
def test_every_number_of_a_mechanism(made):
    check_all(getattr(mechanisms, made)(), skipped=AXES, refused=("inertia",))
