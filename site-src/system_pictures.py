"""Make the pictures of the systems of docs/systems: python site-src/system_pictures.py [NAME ...].

Each system is simulated up to a time and its animation page is opened in Chromium. The scene of that time is cut out
and written to docs/images/systems: NAME.png for the poster, and NAME_sketch.png with labels where a page shows it.
"""

from __future__ import annotations

import io
import runpy
import shutil
import sys
import tempfile
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import Page, sync_playwright

import flyball as fb

ROOT = Path(__file__).parents[1]
EXAMPLES, PICTURES = ROOT / "examples", ROOT / "docs" / "images" / "systems"
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"]
ONLY_THE_SCENE = """.stage {position: fixed !important; inset: 0; z-index: 9}
.stage > :not(canvas) {display: none !important}"""
WINDOW, TILE, SKETCH = (1600, 1200), (480, 360), (880, 660)  # [px]
COLORS = 128  # of a palette, which makes files small
INK, PAPER = "#1d2733", "#ffffff"
BACKGROUND_LIGHT = 226  # lightness (0 to 255) of the darkest background; shadows and parts are darker
MARGIN = 0.05  # around the parts, relative to the size of the picture
Point = tuple[float, float]


@dataclass
class Scene:
    """A file of ``examples/``, the time that is shown, and the times before it of which paths are drawn."""

    file: str
    at: float = 0.0  # [s]
    span: float = 0.02  # [s]
    options: dict[str, Any] = field(default_factory=dict)  # of the function ``mechanism`` of the file
    how: dict[str, Any] = field(default_factory=dict)  # of the simulation
    paths: tuple[str, ...] = ()
    view: str = "iso"
    turned: Point = (0.0, 0.0)  # drag of the mouse [px] that turns the camera
    nearer: tuple[float, float, int] = (0.5, 0.5, 0)  # place to which the camera moves; steps of the wheel
    cut: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)  # part that is shown: left, top, right, bottom


GRAINS = fb.Stepping(step=5e-4, solver="gauss-seidel", iterations=100)
TRACKS = fb.Stepping(step="4 ms", solver="gauss-seidel", tolerance=5e-3)
LABELS: dict[str, dict[str, tuple[Point, Point]]] = {
    "governor": {
        "flywheel": ((0.72, 0.08), (0.48, 0.10)),
        "hinges on the shaft": ((0.62, 0.22), (0.345, 0.235)),
        "ball on its arm": ((0.66, 0.40), (0.46, 0.48)),
        "link": ((0.12, 0.54), (0.285, 0.50)),
        "sleeve": ((0.12, 0.68), (0.325, 0.635)),
        "valve": ((0.62, 0.58), (0.62, 0.72)),
        "steam pipe": ((0.86, 0.66), (0.74, 0.76)),
        "lever": ((0.42, 0.92), (0.56, 0.785)),
    },
    "two_shafts": {
        "upper strand of rope": ((0.38, 0.16), (0.42, 0.315)),
        "lower strand of rope": ((0.38, 0.86), (0.42, 0.685)),
        "drum 1, with motor and damper": ((0.20, 0.27), (0.13, 0.39)),
        "drum 2, with rubber element": ((0.72, 0.13), (0.77, 0.27)),
    },
    "press": {
        "flywheel": ((0.75, 0.07), (0.46, 0.08)),
        "crank": ((0.75, 0.19), (0.385, 0.215)),
        "connecting rod": ((0.75, 0.31), (0.405, 0.315)),
        "ram in its guide": ((0.75, 0.42), (0.44, 0.42)),
        "press force on the workpiece": ((0.75, 0.53), (0.41, 0.54)),
        "frame": ((0.75, 0.65), (0.57, 0.61)),
        "four elastic mounts under the bed": ((0.28, 0.95), (0.22, 0.80)),
    },
    "bogie": {
        "frame": ((0.72, 0.05), (0.53, 0.14)),
        "wheelset": ((0.12, 0.06), (0.315, 0.12)),
        "axle box with primary springs": ((0.22, 0.73), (0.50, 0.45)),
        "roller, driven": ((0.80, 0.90), (0.64, 0.78)),
        "contact of wheel and roller": ((0.74, 0.70), (0.575, 0.535)),
    },
    "truck": {
        "bed": ((0.25, 0.08), (0.35, 0.18)),
        "cab": ((0.80, 0.06), (0.68, 0.18)),
        "mounts": ((0.88, 0.48), (0.77, 0.36)),
        "front wheel, steered": ((0.70, 0.66), (0.61, 0.53)),
        "rear axle": ((0.18, 0.55), (0.24, 0.42)),
        "ramp": ((0.40, 0.86), (0.35, 0.63)),
    },
    "facility": {
        "platform": ((0.22, 0.12), (0.37, 0.25)),
        "piston": ((0.07, 0.40), (0.19, 0.40)),
        "cylinder": ((0.30, 0.60), (0.12, 0.54)),
        "ball joint": ((0.33, 0.72), (0.46, 0.42)),
        "universal joint on the ground": ((0.24, 0.90), (0.49, 0.85)),
        "stroke": ((0.60, 0.70), (0.475, 0.585)),
        "four legs that push from the side": ((0.78, 0.06), (0.68, 0.20)),
    },
}
SYSTEMS = {
    "governor": Scene("governor_criterion.py", 2.0, options={"b": 4.0, "W": 7.8}),
    "two_shafts": Scene("two_shafts.py", 0.3),
    "press": Scene("press.py", 0.3, turned=(-260, 0)),
    "bogie": Scene("bogie_on_rollers.py", 0.3),
    "arm": Scene("robot_arm_circle.py", 1.5, span=1.5, paths=("tip",)),
    "seven_axes": Scene("seven_axes.py", 1.5),
    "facility": Scene("parallel_platforms.py", 0.4),
    "hexapod": Scene("stewart.py", 1.2),
    "truck": Scene("truck.py", 1.7, nearer=(0.29, 0.345, 25), cut=(0.1, 0.08, 0.5, 0.6)),
    "tracked_vehicle": Scene("tracked_vehicle_in_space.py", 0.2, how={"method": TRACKS}),
    "excavator": Scene("excavator.py", 2.0, span=2.0),
    "hourglass": Scene("hourglass.py", 0.5, how={"method": GRAINS}),
    "pile": Scene("pile_in_a_box.py", 1.0, turned=(0, 40)),
    "jansen": Scene("linkages.py", 2.0, span=2.0, paths=("foot S",)),
    "peaucellier": Scene("peaucellier.toml", 2.2, span=2.2, paths=("pencil",)),
    "quick_return": Scene("quick_return.toml", 0.2),
    "bennett": Scene("bennett.py", 0.3),
    "schatz": Scene("schatz.py", 0.3),
    "woodpecker": Scene("woodpecker.py", 0.2, nearer=(0.5, 0.27, 17), cut=(0.3, 0.1, 0.8, 0.6)),
    "wishbone": Scene("double_wishbone.toml", 0.3),
    "top": Scene("heavy_top.toml", 0.5, span=0.5),
    "gripper": Scene("gripper.py", 1.0),
    "delta": Scene("delta_robot.py", 0.3),
    "quadruped": Scene("quadruped.py", 1.0, how={"max_step": 4e-3}),
}


def page_of(scene: Scene) -> str:
    """The animation page of a scene, its last times only."""
    path = EXAMPLES / scene.file
    m = runpy.run_path(str(path))["mechanism"](**scene.options) if path.suffix == ".py" else fb.load(path)
    shown = np.linspace(max(scene.at - scene.span, 0.0), scene.at, 2 + round(scene.span / 0.02))
    run = m.simulate(scene.at, outputs=shown, **scene.how)
    return run.html(paths=scene.paths)


def picture_of(tab: Page, scene: Scene) -> Image.Image:
    """The scene at its time, cut to its parts and to the shape of a tile."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "page.html"
        path.write_text(page_of(scene), encoding="utf-8")
        tab.goto(f"{path.as_uri()}#t={scene.at}&view={scene.view}&theme=light&show=")
        tab.wait_for_selector("body[data-ready]", timeout=300_000)
        tab.add_style_tag(content=ONLY_THE_SCENE)
        tab.wait_for_timeout(500)
        if scene.turned != (0.0, 0.0):
            x, y = WINDOW[0] / 2, WINDOW[1] / 2
            tab.mouse.move(x, y)
            tab.mouse.down()
            tab.mouse.move(x + scene.turned[0], y + scene.turned[1], steps=5)
            tab.mouse.up()
        x, y, steps = scene.nearer
        tab.mouse.move(x * WINDOW[0], y * WINDOW[1])
        tab.mouse.wheel(0, -100 * steps)
        tab.wait_for_timeout(1000)
        return cut_out(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"), scene)


def cut_out(image: Image.Image, scene: Scene) -> Image.Image:
    """The parts of a picture on white, with a margin, in the shape of a tile."""
    colors = np.asarray(image.crop(tuple(round(x * n) for x, n in zip(scene.cut, WINDOW * 2, strict=True))))
    parts = colors.min(axis=2) < BACKGROUND_LIGHT
    rows, columns = np.nonzero(parts)
    x0, x1, y0, y1 = columns.min(), columns.max(), rows.min(), rows.max()
    width = max((x1 - x0), (y1 - y0) * TILE[0] / TILE[1]) * (1.0 + 2.0 * MARGIN)
    height = width * TILE[1] / TILE[0]
    out = Image.new("RGB", (round(width), round(height)), PAPER)
    out.paste(
        Image.fromarray(np.where(parts[:, :, None], colors, 255).astype(np.uint8)),
        (round((width - x0 - x1) / 2), round((height - y0 - y1) / 2)),
    )
    return out


def labelled(image: Image.Image, labels: dict[str, tuple[Point, Point]]) -> Image.Image:
    """The picture with labels, and lines from them to the parts; places are relative to its size."""
    image = image.resize(SKETCH, Image.Resampling.LANCZOS)
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(19)
    for text, (place, target) in labels.items():
        at, end = ((x * SKETCH[0], y * SKETCH[1]) for x, y in (place, target))
        draw.line([at, end], fill=PAPER, width=6)
        draw.line([at, end], fill=INK, width=2)
        draw.circle(end, 4, fill=INK, outline=PAPER)
        box = draw.textbbox(at, text, font=font, anchor="mm")
        draw.rounded_rectangle((box[0] - 5, box[1] - 4, box[2] + 5, box[3] + 4), 4, fill=PAPER, outline=INK)
        draw.text(at, text, fill=INK, font=font, anchor="mm")
    return image


def main(names: list[str]) -> None:
    """Make the pictures of these systems, of all if there is none."""
    PICTURES.mkdir(exist_ok=True)
    warnings.simplefilter("ignore", fb.ModelWarning)
    with sync_playwright() as driver:
        program = shutil.which("chromium") or shutil.which("google-chrome")
        browser = driver.chromium.launch(executable_path=program, args=FLAGS)
        tab = browser.new_page(viewport={"width": WINDOW[0], "height": WINDOW[1]})
        for name in names or SYSTEMS:
            image = picture_of(tab, SYSTEMS[name])
            tile = image.resize(TILE, Image.Resampling.LANCZOS).quantize(COLORS, kmeans=3, dither=Image.Dither.NONE)
            tile.save(PICTURES / f"{name}.png", optimize=True)
            if name in LABELS:
                sketch = labelled(image, LABELS[name]).quantize(COLORS, kmeans=3, dither=Image.Dither.NONE)
                sketch.save(PICTURES / f"{name}_sketch.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
