"""Singular orientations are told, never NaN; angles over time go on without jumps, through singular ones too."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flyball as fb
from flyball import rotations
from tests.rotations.given import ALL, SOME, same_orientation

OUTER = st.floats(-3, 3)


def sharing(sequence, turn, angles):
    """The turn about the line of both outer axes where a sequence is singular: their sum or difference."""
    a, b, c = angles
    i, _, k = ("xyz".index(x) for x in sequence.lower())
    if i == k:
        return turn(a + c) if np.cos(b) > 0 else turn(a - c)
    parity = 1 if "".join(sequence.lower()) in ("xyz", "yzx", "zxy") else -1
    if sequence.islower():
        parity = -parity
    return turn(a + parity * np.sign(np.sin(b)) * c)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("sequence", ALL)
def test_the_choice_at_a_singular_angle(sequence, which):
    """The third angle is 0, the middle one the singular one, and the first carries the whole turn."""
    middle = rotations.singular_angles(sequence)[which]
    given_ = (0.8, middle, -0.3)
    q = rotations.from_euler(given_, sequence)
    for orientation in (q, rotations.matrix(q), -q):
        with pytest.warns(fb.SingularOrientationWarning, match=f"'{sequence}'.*only the sum or difference"):
            a, b, c = rotations.euler(orientation, sequence)
        assert c == 0
        assert b == pytest.approx(middle, abs=1e-15)
        assert a == pytest.approx(sharing(sequence, float, given_), abs=1e-15)
        assert same_orientation(rotations.from_euler((a, b, c), sequence), q, 1e-15)
    assert rotations.is_singular(q, sequence)
    assert rotations.distance_to_singular(q, sequence) < 1e-15


@given(OUTER, st.floats(-13, -1), OUTER, st.sampled_from(ALL), st.sampled_from([(0, 1), (1, -1)]))
def test_near_a_singular_angle(a, power, c, sequence, side):
    """The orientation comes back to rounding at every distance; the distance is told; the flag goes by 1e-7 rad."""
    which, sign = side
    d = 10.0**power
    q = rotations.from_euler((a, rotations.singular_angles(sequence)[which] + sign * d, c), sequence)
    assert rotations.distance_to_singular(q, sequence) == pytest.approx(d, rel=1e-9, abs=1e-15)
    assert rotations.is_singular(q, sequence) == (d < 1e-7) or abs(d / 1e-7 - 1) < 1e-6
    assert rotations.is_singular(q, sequence, tolerance=1.0)
    angles = rotations.euler(q, sequence, singular="choose")
    assert np.all(np.isfinite(angles))
    assert same_orientation(rotations.from_euler(angles, sequence), q, 3e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error", fb.SingularOrientationWarning)
        if d > 1.001e-7:
            split = rotations.euler(q, sequence) - (a, angles[1], c)
            split -= 2 * np.pi * np.round(split / (2 * np.pi))
            assert np.abs(split).max() < 1e-14 / d


def test_raise_on_request():
    q = rotations.from_euler([(0.1, 0.2, 0.3), (0.1, np.pi / 2 - 2e-8, 0.3)], "XYZ")
    with pytest.raises(fb.SingularOrientationError) as e:
        rotations.euler(q, "XYZ", singular="raise")
    assert isinstance(e.value, ValueError)
    assert isinstance(e.value, fb.FlyballError)
    assert e.value.sequence == "XYZ"
    assert e.value.angle == pytest.approx(np.pi / 2 - 2e-8)
    assert e.value.distance == pytest.approx(2e-8, rel=1e-6)
    text = str(e.value)
    assert "1 of 2 orientations are within 1e-07 rad" in text
    assert "index 1: 1.57079631 rad, 2e-08 rad from it" in text
    assert "use another sequence ('" in text
    assert "or the quaternion" in text
    other = text.split("use another sequence ('")[1][:3]
    assert not rotations.is_singular(q[1], other, tolerance=1.0)  # the remedy is one
    assert rotations.euler(q[:1], "XYZ", singular="raise") == pytest.approx(np.array([[0.1, 0.2, 0.3]]), abs=1e-15)
    with pytest.raises(fb.ModelError, match=r"singular='ignore'; give \"warn\", \"raise\" or \"choose\""):
        rotations.euler(q, singular="ignore")


def test_every_sequence_is_regular_somewhere_where_another_is_singular():
    """No sequence is singular nowhere, no two of different middle axes at once everywhere."""
    for sequence in ALL:
        near = rotations.singular_angles(sequence)
        assert near == ((0, np.pi) if sequence[0] == sequence[2] else (-np.pi / 2, np.pi / 2))
        assert rotations.distance_to_singular(SOME, sequence).max() > 1.4
        assert np.all(rotations.distance_to_singular(SOME, sequence) <= np.pi / 2)
        middle = rotations.euler(SOME, sequence)[:, 1]
        exact = np.min(np.abs(middle[:, None] - near), axis=1)
        assert rotations.distance_to_singular(SOME, sequence) == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("sequence", ALL)
def test_angles_go_on_through_singular_orientations(sequence):
    """A middle angle that turns round and round passes four singular orientations a turn pair, the outer ones drift."""
    t = np.linspace(0.1, 9.7, 300)
    angles = np.stack([0.5 * np.sin(t), -0.9 + 1.7 * t, 3 * t], axis=1)
    q = rotations.from_euler(angles, sequence)
    found = rotations.euler(q, sequence, continuous=True)
    turns = (found - angles)[0]  # the same all the time: either family, whole turns
    if np.abs(turns[0] / (2 * np.pi) - np.round(turns[0] / (2 * np.pi))) > 0.25:
        middle = -1 if sequence[0] == sequence[2] else np.pi
        mirrored = np.pi - angles[:, 1] if middle == np.pi else -angles[:, 1]
        angles = np.stack([angles[:, 0] + np.pi, mirrored, angles[:, 2] + np.pi], axis=1)
    turns = (found - angles) / (2 * np.pi)
    assert turns == pytest.approx(np.tile(np.round(turns[0]), (300, 1)), abs=1e-12)
    assert np.abs(np.diff(rotations.euler(q, sequence), axis=0)).max() > 3  # they do jump without
    assert rotations.unwrap(rotations.euler(q, sequence), sequence) == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize("sequence", ["XYZ", "zyx", "ZXZ", "yxy"])
def test_a_sample_right_at_the_singular_angle_is_bridged(sequence):
    """The free angle is that of the time before, so neither it nor the others jump; two series side by side."""
    near = rotations.singular_angles(sequence)[1]
    b = near + 0.01 * np.arange(-5, 6)
    angles = np.stack([np.full(11, 0.7), b, np.full(11, -0.4)], axis=1)
    both = rotations.from_euler(np.stack([angles, angles + [0.1, 0.005, 0.2]], axis=1), sequence)
    with pytest.warns(fb.SingularOrientationWarning, match=r"1 of 22 orientations are .*index \(5, 0\)"):
        found = rotations.euler(both, sequence, continuous=True)
    assert found[:, 0] == pytest.approx(angles, abs=1e-12)
    assert found[:, 1] == pytest.approx(angles + [0.1, 0.005, 0.2], abs=1e-12)


def test_a_series_that_starts_or_stays_singular():
    """At the start the next determined angle holds; with none at all the third is 0 throughout."""
    angles = np.stack([np.full(5, 0.7), 0.1 * np.arange(5), np.full(5, -0.4)], axis=1)
    q = rotations.from_euler(angles, "ZXZ")
    assert rotations.euler(q, "ZXZ", continuous=True, singular="choose") == pytest.approx(angles, abs=1e-14)
    spin = rotations.from_axis_angle((0, 0, 1), np.linspace(0, 20, 60))
    found = rotations.euler(spin, "ZXZ", continuous=True, singular="choose")
    assert found == pytest.approx(np.stack([np.linspace(0, 20, 60), np.zeros(60), np.zeros(60)], axis=1), abs=1e-13)


def test_whole_turns_count():
    t = np.linspace(0, 30, 400)
    angles = np.stack([t, 0.4 * np.sin(t), -2 * t], axis=1)
    assert rotations.bryant(rotations.from_bryant(angles), continuous=True) == pytest.approx(angles, abs=1e-12)
    assert rotations.unwrap(angles[:1]) == pytest.approx(angles[:1])


def test_gibbs_vectors_of_half_turns():
    for d in (0.0, 5e-8):
        with pytest.raises(fb.SingularOrientationError, match=r"at index 1: .* half a turn .*modified Rodrigues") as e:
            rotations.gibbs(rotations.from_axis_angle((1, 2, 2), [1.0, np.pi - d]))
        assert e.value.distance == pytest.approx(d, abs=1e-15)
        assert e.value.angle == pytest.approx(np.pi)
        with pytest.raises(fb.SingularOrientationError):
            rotations.cayley(rotations.from_axis_angle((1, 2, 2), -np.pi - d))
    g = rotations.gibbs(rotations.from_axis_angle((0, 0, 1), np.pi - 1e-6))
    assert g == pytest.approx([0, 0, 2e6], rel=1e-9)
