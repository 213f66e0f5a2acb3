"""Pictures drawn into files: curves over time, and paths of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.view.recording import Channel, Figure, Panel, Picture, PointPaths
from flyball.view.result_plots import write_pictures

T = np.linspace(0.0, 1.0, 40)
CURVE = Channel("a.x", "m", np.sin(7.0 * T))
WAY = np.stack([T, T**2, 0.0 * T], axis=1)
PICTURES = [
    Picture("curves", "m: curves", T, Figure("curves", "Curves", (Panel("x", (CURVE,)),))),
    Picture("paths", "m: paths", T, PointPaths({"a": WAY}, True, "dots: start")),
]


def test_each_picture_is_a_file(tmp_path: Path) -> None:
    written = write_pictures(PICTURES, tmp_path)
    assert [p.name for p in written] == ["curves.png", "paths.png"]
    assert all(p.stat().st_size > 5000 for p in written)


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(fb.ModelError, match=r"cannot write .*curves\.png': there is no folder"):
        write_pictures(PICTURES, tmp_path / "no")
