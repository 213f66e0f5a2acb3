"""Videos of a motion, drawn without a browser: GIF, and MP4 or WebM where ffmpeg is installed.

The scene is drawn as in `still_picture`, from a fixed direction, at evenly spaced times; between the times of the
recording poses are interpolated.
"""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis_options import require_count, require_positive
from ..errors import ModelError
from ..model.output_files import VIDEO, file_extension, replacing_file, write_file
from .page import sign_continuous
from .recording import Recording
from .still_picture import (
    BLOCK_HALF_SIZE,
    GUIDE_COLOR,
    INK_COLOR,
    PAPER_COLOR,
    PIN_RADIUS,
    Stroke,
    coarse_shape,
    scene_strokes,
    still_svg,
)

if TYPE_CHECKING:
    from PIL import Image

    from ..results.result import Result

PICTURE_WIDTH = 1280  # of a picture of the scene [px]
OVERSAMPLING = 2  # pixels drawn for each pixel shown, along each side: smooth edges
MARGIN_SHARE, CAPTION_HEIGHT = 0.04, 22  # margin of the scene, relative to the width; height of the line of text [px]
WATCHABLE = 2.0, 20.0  # durations [s] that are played in real time
USUAL_DURATION = 8.0  # [s] of slowed or quickened motions, about
ROUND_FACTORS = (1.0, 2.0, 5.0, 10.0)


def playing_speed(duration: float) -> float:
    """Return seconds of motion in a second of video: 1 where that is watchable, else a round factor."""
    shortest, longest = WATCHABLE
    if shortest <= duration <= longest:
        return 1.0
    wanted = duration / USUAL_DURATION
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * min(ROUND_FACTORS, key=lambda f: abs(np.log(f * power / wanted))))


def speed_in_words(speed: float) -> str:
    """Return a speed as ``"1/100 of real time"``."""
    if speed == 1.0:
        return "real time"
    return f"1/{1 / speed:g} of real time" if speed < 1.0 else f"{speed:g} times real time"


def resampled(recording: Recording, times: np.ndarray) -> Recording:
    """Return a recording at other times, with positions interpolated linearly and orientations likewise, normalised."""
    t = np.asarray(recording.t, float)
    k = np.clip(np.searchsorted(t, times, side="right") - 1, 0, max(len(t) - 2, 0))
    after = np.minimum(k + 1, len(t) - 1)
    width = t[after] - t[k]
    part = np.divide(times - t[k], width, out=np.zeros(len(times)), where=width > 0.0)

    def between(x: np.ndarray) -> np.ndarray:
        share = part.reshape(-1, *[1] * (x.ndim - 1))
        return np.asarray((1.0 - share) * x[k] + share * x[after])

    def turned(q: np.ndarray) -> np.ndarray:
        flat = np.stack([sign_continuous(x) for x in np.moveaxis(q.reshape(len(q), -1, 4), 1, 0)], axis=1)
        mean = between(flat)
        return (mean / np.linalg.norm(mean, axis=2, keepdims=True)).reshape(len(times), *q.shape[1:])

    return dataclasses.replace(
        recording,
        t=times,
        bodies=tuple(
            dataclasses.replace(b, p=between(b.p), q=turned(b.q), shapes=tuple(map(coarse_shape, b.shapes)))
            for b in recording.bodies
        ),
        lines=tuple(dataclasses.replace(x, points=tuple(map(between, x.points))) for x in recording.lines),
        sets=tuple(dataclasses.replace(s, p=between(s.p), q=turned(s.q)) for s in recording.sets),
    )


def save_video(
    result: Result, path: Any, *, speed: float | None = None, frames_per_second: int = 25, width: int = 800
) -> None:
    """Write the animation of a result as a video.

    Parameters
    ----------
    result : Result
    path : str or path
        Its ending selects the format: .gif, or .mp4 and .webm, which need ffmpeg (extra ``video``).
    speed : float, optional
        Seconds of motion in a second of video; by default 1, or a round factor for short and long motions.
    frames_per_second : int
    width : int [px]

    Raises
    ------
    ModelError
        If the ending is unknown, the file cannot be written, or ffmpeg is not installed.
    """
    from .animation import record_motion

    ending = file_extension(path, VIDEO)
    require_count(frames_per_second, "frames_per_second")
    require_count(width, "width")
    recording = record_motion(result, curves=False, with_notes=False)
    duration = float(recording.t[-1] - recording.t[0])
    if speed is None:
        speed = playing_speed(duration) if duration > 0.0 else 1.0
    require_positive(speed, "speed")
    interval = 1.0 / frames_per_second
    if ending == ".gif":  # whole hundredths of a second; browsers slow down what is faster than two
        interval = max(2, round(100 * interval)) / 100
    count = max(1, round(duration / speed / interval))
    times = recording.t[0] + np.arange(count + 1) * speed * interval
    recording = resampled(recording, np.minimum(times, recording.t[-1]))
    frames = _frames(recording, width - width % 2, speed_in_words(speed))
    if ending == ".gif":
        _write_gif(path, frames, interval)
    else:
        _write_by_ffmpeg(path, ending, frames, frames_per_second)


def write_scene(result: Result, path: Any) -> None:
    """Write the animated scene in glTF (.glb), or a picture of it at the first time (.png, .svg)."""
    from .animation import record_motion
    from .gltf import gltf_scene

    recording = record_motion(result, curves=False, with_notes=False)
    ending = Path(path).suffix.lower()
    if ending == ".glb":
        write_file(path, gltf_scene(recording))
    elif ending == ".svg":
        write_file(path, still_svg(recording, f"{recording.name} at t = {recording.t[0]:g} s"))
    else:
        (frame,) = _frames(resampled(recording, recording.t[:1]), PICTURE_WIDTH, "")
        with replacing_file(path) as file:
            frame.save(file, "PNG")


def _write_gif(path: Any, frames: Iterator[Image.Image], interval: float) -> None:
    from PIL import Image

    first, *rest = (f.quantize(64, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE) for f in frames)
    with replacing_file(path, VIDEO) as file:
        first.save(file, "GIF", save_all=True, append_images=rest, duration=round(1000 * interval), loop=0)


def _ffmpeg() -> str | None:
    """Return the program ffmpeg: the installed one, else that of the package imageio-ffmpeg, else None."""
    if program := shutil.which("ffmpeg"):
        return program
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):  # it has none for this system
        return None


def _write_by_ffmpeg(path: Any, ending: str, frames: Iterator[Image.Image], rate: int) -> None:
    program = _ffmpeg()
    if program is None:
        raise ModelError(
            f"a video {ending} needs the program ffmpeg: install it, or run pip install 'flyball[video]'; .gif needs "
            "neither, and a page saves its animation as MP4 or WebM"
        )
    codec = ["-c:v", "libx264", "-crf", "20"] if ending == ".mp4" else ["-c:v", "libvpx-vp9", "-crf", "32", "-b:v", "0"]
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / f"video{ending}"
        for k, frame in enumerate(frames):
            frame.save(Path(folder) / f"{k:06}.png")
        command = [program, "-y", "-framerate", str(rate), "-i", str(Path(folder) / "%06d.png"), *codec]
        done = subprocess.run([*command, "-pix_fmt", "yuv420p", str(made)], capture_output=True, text=True, check=False)
        if done.returncode:
            said = "; ".join(done.stderr.strip().splitlines()[-3:])
            raise ModelError(f"ffmpeg cannot write {str(path)!r}: {said or f'it ended with {done.returncode}'}")
        with replacing_file(path, VIDEO) as file:
            file.write(made.read_bytes())


def _frames(recording: Recording, width: int, speed: str) -> Iterator[Image.Image]:
    """Draw the scene at every time, with one scale for all."""
    scenes = [scene_strokes(recording, k) for k in range(len(recording.t))]
    every = np.concatenate([s.points for scene in scenes for s in scene] or [np.zeros((1, 2))])
    low, high = every.min(axis=0), every.max(axis=0)
    extent = np.maximum(high - low, 1e-9 * max(recording.size, 1e-300))
    margin = MARGIN_SHARE * width
    scale = (width - 2 * margin) / extent[0]
    height = min(extent[1] * scale, 0.75 * width)
    scale = min(scale, height / extent[1])
    size = width, int(2 * np.ceil(0.5 * (height + 2 * margin + CAPTION_HEIGHT)))
    middle = 0.5 * (low + high)
    interval = (recording.t[-1] - recording.t[0]) / max(len(recording.t) - 1, 1) or 1.0
    digits = max(0, int(np.ceil(-np.log10(interval))))
    for t, scene in zip(recording.t, scenes, strict=True):
        centre = np.array([0.5 * size[0], 0.5 * (size[1] - CAPTION_HEIGHT)])
        placed = [(s, centre + (s.points - middle) * scale * [1.0, -1.0]) for s in scene]
        yield _picture(size, placed, f"t = {t:.{digits}f} s, {speed}" if speed else "")


def _picture(size: tuple[int, int], strokes: list[tuple[Stroke, np.ndarray]], caption: str) -> Image.Image:
    """Return the picture of a scene."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGB", (OVERSAMPLING * size[0], OVERSAMPLING * size[1]), PAPER_COLOR)
    draw = ImageDraw.Draw(image)
    for s, points in strokes:
        _draw_stroke(draw, s, OVERSAMPLING * points)
    image = image.resize(size, Image.Resampling.BOX)
    font = ImageFont.load_default(13)
    ImageDraw.Draw(image).text((10, size[1] - CAPTION_HEIGHT), caption, fill=INK_COLOR, font=font)
    return image


def _draw_stroke(draw: Any, s: Stroke, points: np.ndarray) -> None:
    """Draw a stroke; ``points`` are in drawn pixels."""
    line = max(1, round(OVERSAMPLING * s.width))
    if s.pin:
        _draw_pin(draw, s.pin, *points[0].tolist())
        return
    corners = [tuple(p) for p in points.tolist()]
    if s.closed and len(corners) > 2 and s.fill != "none":
        draw.polygon(corners, fill=s.fill)
    if s.dash:
        _draw_dashes(draw, points, [OVERSAMPLING * float(x) for x in s.dash.split()], s.stroke, line)
    else:
        draw.line([*corners, corners[0]] if s.closed else corners, fill=s.stroke, width=line, joint="curve")


def _draw_dashes(draw: Any, points: np.ndarray, dash: list[float], color: str, width: int) -> None:
    """Draw a line of dashes: lengths of a dash and of a gap in drawn pixels."""
    for a, b in pairwise(points):
        length = float(np.hypot(*(b - a)))
        for start in np.arange(0.0, length, sum(dash)):
            ends = [a + (b - a) * min(x, length) / length for x in (start, start + dash[0])]
            draw.line([tuple(p.tolist()) for p in ends], fill=color, width=width)


def _draw_pin(draw: Any, pin: str, x: float, y: float) -> None:
    """Draw a joint's mark."""
    k, line = OVERSAMPLING, round(1.6 * OVERSAMPLING)
    if pin == "ground":
        foot, half = y + 12 * k, 9 * k
        draw.polygon([(x, y), (x - half, foot), (x + half, foot)], fill="#e9edf1", outline=INK_COLOR, width=k)
        for d in (-5, 0, 5, 10):
            draw.line([(x + d * k, foot), (x + (d - 4) * k, foot + 5 * k)], fill=GUIDE_COLOR, width=k)
        return
    r = k * (BLOCK_HALF_SIZE if pin == "block" else PIN_RADIUS)
    shape = draw.rectangle if pin == "block" else draw.ellipse
    shape([x - r, y - r, x + r, y + r], fill=PAPER_COLOR, outline=INK_COLOR, width=line)
