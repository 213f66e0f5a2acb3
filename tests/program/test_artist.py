"""Pictures drawn by a second process: the same files and the same messages, and this one draws where it cannot."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.view import beside
from flyball.view.artist import draw
from flyball.view.beside import Artist
from flyball.view.recording import Channel, Figure, Panel, Picture, PointPaths

T = np.linspace(0.0, 1.0, 40)
CURVE = Channel("a.x", "m", np.sin(7.0 * T))
WAY = np.stack([T, T**2, 0.0 * T], axis=1)
PICTURES = [
    Picture("curves", "m: curves", T, Figure("curves", "Curves", (Panel("x", (CURVE,)),))),
    Picture("paths", "m: paths", T, PointPaths({"a": WAY}, True, "dots: start")),
]


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second process, whatever this one has imported and however many cores there are."""
    monkeypatch.setattr(beside, "loaded", lambda: False)
    monkeypatch.setattr(beside, "cores", lambda: 2)


def folder(path: Path, name: str) -> Path:
    made = path / name
    made.mkdir()
    return made


def test_both_draw_the_same(second: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there, here = folder(tmp_path, "there"), folder(tmp_path, "here")
    with Artist() as artist:
        artist.begin(PICTURES, there)
        monkeypatch.setattr(beside, "draw", lambda *_: pytest.fail("this process drew"))
        written = artist.finish()
    assert [p.name for p in written] == ["curves.png", "paths.png"]
    from matplotlib.image import imread

    for mine, its in zip(draw(PICTURES, here), written, strict=True):
        a, b = imread(mine), imread(its)  # other tests may have left this process other settings
        assert a.shape == b.shape
        assert np.abs(a - b).mean() < 0.02


@pytest.mark.parametrize("alone", [False, True])
def test_what_cannot_be_written_is_told(second: None, tmp_path: Path, alone: bool) -> None:
    with Artist(beside=not alone) as artist:
        artist.begin(PICTURES, tmp_path / "no")
        with pytest.raises(fb.ModelError, match=r"cannot write .*curves\.png': there is no folder"):
            artist.finish()


def test_where_none_can_be_started_this_process_draws(
    second: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", os.fspath(tmp_path / "no python"))
    with Artist() as artist:
        artist.begin(PICTURES, tmp_path)
        assert all(p.stat().st_size > 5000 for p in artist.finish())


def test_where_it_dies_this_process_draws(second: None, tmp_path: Path) -> None:
    with Artist() as artist:
        assert artist._process is not None
        artist._process.kill()
        artist.begin(PICTURES, tmp_path)
        assert all(p.stat().st_size > 5000 for p in artist.finish())


def test_none_is_left_behind(second: None, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), Artist() as idle:
        raise KeyboardInterrupt
    with Artist() as busy:
        busy.begin(PICTURES, tmp_path)
    for artist in (idle, busy):
        assert artist._process is not None
        assert artist._process.returncode is not None
        assert artist._talk is None or not artist._talk.is_alive()


def test_it_ends_in_silence_when_nothing_is_asked() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "from flyball.view.artist import main; main()"], input=b"", capture_output=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, b"", b"")


def test_one_core_or_no_pictures_want_none(second: None, monkeypatch: pytest.MonkeyPatch) -> None:
    assert Artist(beside=False)._process is None
    monkeypatch.setattr(beside, "cores", lambda: 1)
    assert Artist()._process is None


def test_the_command_imports_neither_units_nor_sparse_matrices_nor_pictures(tmp_path: Path) -> None:
    code = (
        "import sys; from flyball.view import beside; beside.cores = lambda: 2\n"
        "from flyball.cli import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit as end: assert not end.code\n"
        "print([k for k in ('pint', 'scipy.sparse', 'matplotlib', 'xarray', 'pandas') if k in sys.modules])"
    )
    model = "examples/slider_crank.toml"
    asked = ["run", model, "--t-end", "0.1", "--out", os.fspath(tmp_path), "--quiet"]
    done = subprocess.run([sys.executable, "-c", code, *asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert sorted(p.name for p in (tmp_path / "plots").iterdir()) == sorted(
        f"{k}.png" for k in ("energy", "coordinates", "paths", "reactions", "actuation")
    )
