"""What the page carries: complete, compact, and refused with a clear message when it cannot be shown."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from flyball.view.page import PLAYER_MODULES, animation_page, pack_recording
from flyball.view.recording import RecordedArrow, RecordedJoint, RecordedPath, Shape
from tests.view.recordings import loaded, planar, spatial


def test_numbers_come_back_from_the_block() -> None:
    recording = spatial()
    data = pack_recording(recording)
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    start = -(-(4 + length) // 8) * 8
    for body, kept in zip(recording.bodies, header["bodies"], strict=True):
        place = kept["p"]
        raw = np.frombuffer(data, np.uint8, 4 * place["count"], start + place["at"])
        columns = raw.reshape(4, -1).T.copy().view("<f4").reshape(3, -1)
        np.testing.assert_allclose(columns.T, body.p, atol=1e-6)


def test_equal_arrays_are_stored_once() -> None:
    recording = planar()
    twins = tuple(replace(recording.channels[0], name=f"twin {k}") for k in range(50))
    more = len(pack_recording(replace(recording, channels=(*recording.channels, *twins)))) - len(
        pack_recording(recording)
    )
    assert more < 50 * 120  # names and references, not 81 numbers each


def test_the_page_is_compact_and_the_same_each_time() -> None:
    document = animation_page(planar())
    assert len(document) < 450_000
    assert document == animation_page(planar())
    assert "three.js authors" in document and "Leon Sorokin" in document  # the licences travel with the libraries


def test_a_single_sample_is_a_picture() -> None:
    recording = planar()
    bodies = tuple(replace(body, p=body.p[:1], q=body.q[:1]) for body in recording.bodies)
    assert animation_page(replace(recording, t=recording.t[:1], bodies=bodies, lines=(), channels=()))


def _mesh(triangles: list[list[int]]) -> Shape:
    return Shape("mesh", (), vertices=np.eye(3), triangles=np.array(triangles))


@pytest.mark.parametrize("flat", [False, True])
def test_every_kind_of_symbol_is_packed_even_an_unknown_one(flat: bool) -> None:
    assert len(animation_page(loaded(flat))) < 450_000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: {"t": r.t[:-1]}, r"body 'link': p must have shape \(80, 3\)"),
        (lambda r: {"t": r.t[:0]}, "at least one time"),
        (lambda r: {"t": r.t[::-1]}, "must not decrease"),
        (lambda r: {"size": 0.0}, "size must be a positive length"),
        (lambda r: {"lines": (replace(r.lines[0], kind="chain"),)}, "line 'spring': unknown kind 'chain'"),
        (lambda r: {"lines": (replace(r.lines[0], points=r.lines[0].points[:1]),)}, "a spring takes two points, got 1"),
        (lambda r: {"lines": (replace(r.lines[0], kind="rope", rest=r.t[1:]),)}, r"rest must have shape \(81,\)"),
        (lambda r: {"show": ("everything",)}, "show: unknown kind 'everything'"),
        (lambda r: {"paths": (RecordedPath("p", "gone"),)}, "path 'p' rides on body 'gone'"),
        (
            lambda r: {"arrows": (RecordedArrow("a", "load", "force", "link", (0, 0, 0), r.t),)},
            r"arrow 'a': vector must have shape \(81, 3\)",
        ),
        (
            lambda r: {"bodies": (replace(r.bodies[0], shapes=(_mesh([[0, 1, 7]]),)),)},
            "a mesh that cannot be drawn: .* its triangles name those 3",
        ),
        (lambda r: {"joints": (RecordedJoint("j", "revolute", "gone", (0, 0, 0), (0, 0, 1)),)}, "rides on body 'gone'"),
        (lambda r: {"bodies": r.bodies[:1] * 2}, "two bodies are named 'link'"),
        (lambda r: {"bodies": (replace(r.bodies[0], shapes=(Shape("box", (1.0,)),)),)}, "a box takes 3 lengths"),
        (lambda r: {"bodies": (replace(r.bodies[0], shapes=(Shape("plate", (0.1,)),)),)}, "outline needs three points"),
    ],
)
def test_what_cannot_be_shown_is_refused(change: object, message: str) -> None:
    recording = planar()
    with pytest.raises(ValueError, match=message):
        animation_page(replace(recording, **change(recording)))


def test_the_bundle_holds_all_that_the_player_takes() -> None:
    static = files("flyball.view").joinpath("static")
    bundle = static.joinpath("libraries.min.js").read_text(encoding="utf-8")
    for name in PLAYER_MODULES:
        for taken in re.findall(r"\bTHREE\.(\w+)", static.joinpath("player", f"{name}.js").read_text(encoding="utf-8")):
            assert f"{taken}:()=>" in bundle, f"{name}.js takes {taken}: add it to view-src/libraries.mjs and rebuild"
