"""What the page carries: complete, compact, and refused with a clear message when it cannot be shown."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from flyball.view.page import MODULES, page
from flyball.view.payload import payload
from flyball.view.recording import RecordedJoint, Shape
from tests.view.recordings import planar, spatial


def test_numbers_come_back_from_the_block() -> None:
    recording = spatial()
    data = payload(recording)
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    start = -(-(4 + length) // 8) * 8
    for body, kept in zip(recording.bodies, header["bodies"], strict=True):
        place = kept["p"]
        raw = np.frombuffer(data, np.uint8, 4 * place["count"], start + place["at"])
        columns = raw.reshape(4, -1).T.copy().view("<f4").reshape(3, -1)
        np.testing.assert_allclose(columns.T, body.p, atol=1e-6)


def test_the_page_is_compact_and_the_same_each_time() -> None:
    document = page(planar())
    assert len(document) < 400_000
    assert document == page(planar())
    assert "three.js authors" in document and "Leon Sorokin" in document  # the licences travel with the libraries


def test_a_single_sample_is_a_picture() -> None:
    recording = planar()
    bodies = tuple(replace(body, p=body.p[:1], q=body.q[:1]) for body in recording.bodies)
    assert page(replace(recording, t=recording.t[:1], bodies=bodies, lines=(), channels=()))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: {"t": r.t[:-1]}, r"body 'link': p must have shape \(80, 3\)"),
        (lambda r: {"t": r.t[:0]}, "at least one time"),
        (lambda r: {"t": r.t[::-1]}, "must not decrease"),
        (lambda r: {"size": 0.0}, "size must be a positive length"),
        (lambda r: {"lines": (replace(r.lines[0], kind="chain"),)}, "line 'spring': unknown kind 'chain'"),
        (lambda r: {"joints": (RecordedJoint("j", "revolute", "gone", (0, 0, 0), (0, 0, 1)),)}, "rides on body 'gone'"),
        (lambda r: {"bodies": r.bodies[:1] * 2}, "two bodies are named 'link'"),
        (lambda r: {"bodies": (replace(r.bodies[0], shapes=(Shape("box", (1.0,)),)),)}, "a box takes 3 lengths"),
        (lambda r: {"bodies": (replace(r.bodies[0], shapes=(Shape("plate", (0.1,)),)),)}, "outline needs three points"),
    ],
)
def test_what_cannot_be_shown_is_refused(change: object, message: str) -> None:
    recording = planar()
    with pytest.raises(ValueError, match=message):
        page(replace(recording, **change(recording)))


def test_the_bundle_holds_all_that_the_player_takes() -> None:
    static = files("flyball.view").joinpath("static")
    bundle = static.joinpath("libraries.min.js").read_text(encoding="utf-8")
    for name in MODULES:
        for taken in re.findall(r"\bTHREE\.(\w+)", static.joinpath("player", f"{name}.js").read_text(encoding="utf-8")):
            assert f"{taken}:()=>" in bundle, f"{name}.js takes {taken}: add it to view-src/libraries.mjs and rebuild"
