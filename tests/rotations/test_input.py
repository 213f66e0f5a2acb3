"""What is not a rotation is refused, with the place, the value, the rule and a remedy."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball import rotations

BAD = [
    (lambda: rotations.matrix((0, 0, 0, 0)), r"rotations\.matrix: \[0.0, 0.0, 0.0, 0.0\] has no direction; a quaternion must not be zero"),
    (lambda: rotations.euler([[1, 0, 0, 0], [0, 0, 0, 0]]), r"rotations\.euler at index 1: \[0.0, .* must not be zero"),
    (lambda: rotations.euler((0.1, 0.2, 0.3)), r"rotations\.euler: an orientation is a quaternion .* from_euler.* the shape is \(3,\)"),
    (lambda: rotations.matrix(1.0), r"the shape is \(\)"),
    (lambda: rotations.matrix([[1, 2], [3]]), r"rotations\.matrix: \[\[1, 2\], \[3\]\] is not an array"),
    (lambda: rotations.matrix((1, 0, np.nan, 0)), "at index 2: nan is not a finite number"),
    (lambda: rotations.matrix(["1", "0", "0", "0"]), "does not consist of numbers"),
    (lambda: rotations.quaternion(1.001 * np.eye(3)), r"is not a rotation: its columns must be orthonormal, but R\^T R is off by 0.002 \(at most 1e-09\)"),
    (lambda: rotations.quaternion([np.eye(3), 2 * np.eye(3)]), "at index 1: the matrix is not a rotation"),
    (lambda: rotations.from_matrix(np.diag([1, 1, -1])), "is not a rotation: it mirrors, so make its columns right-handed"),
    (lambda: rotations.from_matrix((1, 0, 0, 0)), r"rotations\.from_matrix: the shape is \(4,\), expected \(..., 3, 3\)"),
    (lambda: rotations.nearest(np.zeros((3, 3))), "no single rotation is closest .*determinant 0"),
    (lambda: rotations.nearest(np.diag([1, 1, -1])), "no single rotation is closest .*determinant -1"),
    (lambda: rotations.nearest(1j * np.eye(3)), "the matrix is complex"),
    (lambda: rotations.from_axis_angle((0, 0, 0), 1), r"axis: \[0.0, 0.0, 0.0\] has no length; an axis must not be zero \(for no rotation"),
    (lambda: rotations.from_axis_angle((0, 0, 1), "90 deg"), "angle: '90 deg' does not consist of numbers; angles are in radians"),
    (lambda: rotations.from_axis_angle((0, 1), 1), r"axis: the shape is \(2,\), expected \(..., 3\)"),
    (lambda: rotations.from_rotation_vector((1, 2, 3, 4)), r"the shape is \(4,\), expected \(..., 3\)"),
    (lambda: rotations.from_gibbs((1, np.inf, 3)), "at index 1: inf is not a finite number"),
    (lambda: rotations.from_cayley(np.eye(3)), "S [+] S.T has an entry 2; S must be skew-symmetric"),
    (lambda: rotations.from_euler((1, 2), "XYZ"), r"rotations\.from_euler: the shape is \(2,\)"),
    (lambda: rotations.apply(np.eye(3), (1, 2)), r"rotations\.apply: vectors: the shape is \(2,\)"),
    (lambda: rotations.compose(np.eye(3), (1, 2)), r"rotations\.compose: an orientation is"),
    (lambda: rotations.euler(np.eye(3), continuous=True), "continuous=True needs a series"),
    (lambda: rotations.unwrap((1, 2, 3)), "give a series of angles"),
    (lambda: rotations.euler_H((1, 2, 3), axes="world"), "axes='world'; give \"body\""),
    (lambda: rotations.rotation_vector_rates((1, 2, 3), (1, 2, 3), "world"), r"rotations\.rotation_vector_rates: axes='world'"),
    (lambda: rotations.quaternion_rates((2, 0, 0, 0), (1, 2, 3)), r"is as long as 2 \(rule: 1 to 1e-6\); divide it by its length"),
    (lambda: rotations.quaternion_rates((1, 0, 0, 0), (1, 2)), r"angular velocity: the shape is \(2,\)"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "message"), BAD)
def test_message(wrong, message):
    with pytest.raises(fb.ModelError, match=message) as e:
        wrong()
    assert isinstance(e.value, ValueError)


@pytest.mark.parametrize("name", ["XXY", "XYY", "XYZX", "ABC", "", 3, None, ["XYZ"]])
@pytest.mark.parametrize(
    "function",
    [
        lambda s: rotations.euler(np.eye(3), s),
        lambda s: rotations.from_euler((1, 2, 3), s),
        lambda s: rotations.euler_H((1, 2, 3), s),
        lambda s: rotations.euler_H_inverse((1, 2, 3), s),
        lambda s: rotations.is_singular(np.eye(3), s),
        lambda s: rotations.unwrap(np.ones((2, 3)), s),
        rotations.singular_angles,
    ],
)
def test_unknown_sequence(function, name):
    with pytest.raises(
        fb.ModelError, match=r"there is no sequence of Euler angles .* neighbours different; .*XYX, XYZ, XZX"
    ):
        function(name)


def test_mixed_case_is_told_from_a_typing_error():
    with pytest.raises(fb.ModelError, match=r"'XyZ': it takes either all upper case or all lower case"):
        rotations.from_euler((1, 2, 3), "XyZ")


def test_the_model_refuses_the_same():
    m = fb.Mechanism("m")
    with pytest.raises(fb.ModelError, match=r"orientation of Body 'b': \[0.*a quaternion must not be zero"):
        m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), orientation=(0, 0, 0, 0)))
    with pytest.raises(fb.ModelError, match="is not a rotation"):
        fb.Body("b", mass=1, inertia=(1, 1, 1), orientation=2 * np.eye(3))


def test_public_names():
    """All that is offered has a docstring with the errors it raises, and comes with the package only when asked for."""
    assert "rotations" in dir(fb)
    for name in rotations.__all__:
        thing = getattr(rotations, name)
        if callable(thing):
            assert thing.__doc__, name
            assert "Raises" in thing.__doc__ or name in ("bryant", "from_bryant", "random"), name
    assert {n for n in dir(rotations) if n.startswith("from_")} <= set(rotations.__all__)
