"""Videos without a browser: duration, speed in words, poses between output times, formats."""

import shutil
import sys

import numpy as np
import pytest
from PIL import Image

import flyball as fb
from flyball.view.animation import record_motion
from flyball.view.video import _ffmpeg, playing_speed, resampled, speed_in_words


@pytest.mark.parametrize(
    ("duration", "speed", "words"),
    [
        (5.0, 1.0, "real time"),
        (0.03, 0.005, "1/200 of real time"),
        (0.4, 0.05, "1/20 of real time"),
        (60.0, 10.0, "10 times real time"),
        (3600.0, 500.0, "500 times real time"),
    ],
)
def test_short_and_long_motions_are_watchable(duration, speed, words):
    assert playing_speed(duration) == pytest.approx(speed)
    assert speed_in_words(playing_speed(duration)) == words
    assert 2.0 <= duration / playing_speed(duration) <= 20.0


def test_poses_between_output_times():
    m = fb.Mechanism("disc", planar=True)
    m.add(fb.Body("disc", mass=1, inertia=1, velocity=(1, 0), angular_velocity=2.0, shape=fb.Box(edges=(1, 1, 1))))
    run = m.simulate(1.0, outputs=21)
    times = np.array([0.0, 0.125, 0.5, 0.9999])
    seen = resampled(record_motion(run, curves=False, with_notes=False), times).bodies[0]
    assert seen.p[:, 0] == pytest.approx(times)
    assert 2 * np.arctan2(seen.q[:, 3], seen.q[:, 0]) == pytest.approx(2 * times, abs=1e-4)


def test_a_gif_has_its_pictures(tmp_path):
    run = fb.load("examples/rope_pendulum.toml").simulate(2.0, outputs=41)
    run.to_video(tmp_path / "a.gif", frames_per_second=5, width=200)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 11
        assert film.width == 200
        assert film.info["duration"] == 200  # ms
        first = np.array(film.convert("L"), float)
        film.seek(5)
        assert np.abs(np.array(film.convert("L"), float) - first).max() > 100
    with pytest.raises(fb.ModelError, match="speed must be greater than 0"):
        run.to_video(tmp_path / "a.gif", speed=0.0)
    with pytest.raises(fb.ModelError, match=r"must be \.gif or \.mp4 or \.webm"):
        run.to_video(tmp_path / "a.avi")


def test_sets_of_bodies_are_drawn(tmp_path):
    m = fb.Mechanism("balls", gravity=(0, 0, -9.81))
    places = [(x, 0.0, 1.0) for x in (0.0, 1.0, 2.0)]
    m.add(fb.Bodies("balls", position=places, shape=fb.Sphere(radius=0.2), density=1000))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact("touch", friction=0.5))
    m.simulate(0.1, outputs=3).to_video(tmp_path / "a.gif", speed=0.1, frames_per_second=3, width=200)
    with Image.open(tmp_path / "a.gif") as film:
        assert len(np.unique(np.array(film.convert("RGB")).reshape(-1, 3), axis=0)) > 4


def test_other_formats_need_ffmpeg(tmp_path, monkeypatch):
    run = fb.load("examples/rope_pendulum.toml").simulate(0.5, outputs=11)
    if _ffmpeg():
        run.to_video(tmp_path / "a.mp4", speed=1.0, frames_per_second=5, width=160)
        assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(
        fb.ModelError,
        match=r"needs the program ffmpeg: install it, or run pip install 'flyball\[video\]'; \.gif needs neither",
    ):
        run.save(tmp_path / "b.mp4")
