"""Tracks that cannot be: numbers of shoes, wheels of two kinds, teeth without room."""

from __future__ import annotations

import pytest

import flyball as fb

SPROCKET = fb.TrackWheel("sprocket", at=(2, 0.5), mass=50, teeth=13)
IDLER = fb.TrackWheel("idler", at=(0, 0.5), mass=50, radius=0.3, slide=(-1, 0), stiffness=1e5, load=1e4)
CHAIN = {"shoes": 40, "pitch": 0.15, "thickness": 0.03, "mass": 8}


@pytest.mark.parametrize(
    ("wheels", "changes", "message"),
    [
        ([SPROCKET, IDLER], {"shoes": 30}, r"30 shoes do not fit .* it has 40: give shoes=40"),
        ([SPROCKET, IDLER], {"shoes": 42}, r"42 shoes do not fit .* give shoes=40"),
        ([SPROCKET, SPROCKET, IDLER], {}, "two wheels are named 'sprocket'"),
        ([SPROCKET], {}, "0 of its 1 wheels have a slide"),
        ([SPROCKET, IDLER], {"pitch": 0}, "pitch is 0; it must be greater than 0"),
        ([SPROCKET, IDLER], {"thickness": 0.2, "shoes": 42}, "leave no room for teeth"),
    ],
)
def test_refused_tracks(wheels, changes, message):
    with pytest.raises(fb.ModelError, match=message):
        fb.track("track", wheels, **(CHAIN | changes))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"radius": 0.2, "arm": (0, 1), "slide": (1, 0), "stiffness": 1}, "arm and slide exclude each other"),
        ({"radius": 0.2, "teeth": 12}, "give radius, or teeth"),
        ({}, "give radius, or teeth"),
        ({"radius": 0.2, "load": 5}, "stiffness belongs to arm or slide"),
        ({"radius": 0.2, "arm": (0, 1)}, "stiffness belongs to arm or slide"),
        ({"radius": -1}, "radius is -1; it must be greater than 0"),
        ({"teeth": 4}, "teeth is 4; it must be greater than 4"),
    ],
)
def test_refused_wheels(fields, message):
    with pytest.raises(fb.ModelError, match=message):
        fb.TrackWheel("wheel", at=(0, 0), mass=1, **fields)


@pytest.mark.parametrize(
    ("wheels", "changes", "message"),
    [
        ([SPROCKET, IDLER], {"shoes": 40.5}, "shoes is 40.5; give a whole number"),
        ([SPROCKET, IDLER, fb.TrackWheel("roller", at=(1, 0.5), mass=5, radius=0.1)], {}, "'roller' is .* m inside"),
        ([SPROCKET, IDLER, fb.TrackWheel("roller", at=(1, 0.9), mass=5, radius=0.05)], {}, "too small for a pitch"),
        ([SPROCKET, IDLER], {"width": 0.3, "wheel_width": 0.4}, "give narrower wheels"),
        ([SPROCKET, IDLER], {"pitch": "15 kg"}, "pitch"),
    ],
)
def test_refused_shapes(wheels, changes, message):
    with pytest.raises(fb.ModelError, match=message):
        fb.track("track", wheels, **(CHAIN | changes))


def test_fractions_of_teeth():
    with pytest.raises(fb.ModelError, match="give a whole number"):
        fb.TrackWheel("wheel", at=(0, 0), mass=1, teeth=12.5)


def test_numbers_with_units():
    """They are those in SI units."""
    sprocket = fb.TrackWheel("sprocket", at=("200 cm", "0.5 m"), mass="50 kg", teeth=13)
    spring = {"stiffness": "100 N/mm", "load": "10 kN"}
    idler = fb.TrackWheel("idler", at=(0, "50 cm"), mass=50, radius="30 cm", slide=(-1, 0), **spring)
    chain = {"shoes": 40, "pitch": "15 cm", "thickness": "30 mm", "mass": "8 kg"}
    got, expected = fb.track("track", [sprocket, idler], **chain), fb.track("track", [SPROCKET, IDLER], **CHAIN)
    for b in expected.bodies:
        assert got[b.name].position == pytest.approx(b.position, abs=1e-12)
