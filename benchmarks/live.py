"""Live pages: pictures a second while a slider moves, a body is dragged, and the mechanism is stepped.

Each example is served, opened in Chromium (with software graphics where there is no other), and worked on as a hand
does, for two seconds each. ``session`` is the time of the session alone, without a browser: simulate, record, pack.

Usage: ``python live.py``; names of examples as arguments.
"""

from __future__ import annotations

import json
import shutil
import sys
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

import flyball as fb
from flyball.live import LiveOptions
from flyball.live.server import LiveServer
from flyball.live.session import LiveSession

EXAMPLES = Path(__file__).parent.parent / "examples"
NAMES = ("slider_crank", "quick_return", "governor", "double_wishbone", "stick_slip", "rope_pendulum")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SECONDS = 2.0


def options() -> LiveOptions:
    return LiveOptions(t_end=5.0, outputs=501, ranges=None, port=0, no_open=True)


def session_ms(m: fb.Mechanism) -> float:
    """Time from a new value to the packed motion, the median of ten."""
    session = LiveSession(lambda: m, options())
    list(session.work())
    name = next(iter(m.parameters))
    env = session.sliders[name].value
    took = []
    for k in range(10):
        session.receive(json.dumps({"do": "set", "name": name, "value": env * (1.0 + 0.01 * k)}))
        began = time.perf_counter()
        list(session.work())
        took.append(time.perf_counter() - began)
    return 1e3 * sorted(took)[5]


def rates(tab: Any, body: str) -> tuple[float, float, float]:
    """Pictures a second: of runs, of dragging, of stepping."""
    runs = tab.evaluate(
        """async (seconds) => {
          const slider = document.querySelector(".parameter input[type=range]");
          const [begin, before, middle] = [performance.now(), flyball.live.runs, Number(slider.value)];
          for (let k = 0; performance.now() - begin < 1000 * seconds; k++) {
            slider.value = middle * (1 + 0.05 * Math.sin(0.1 * k));
            slider.dispatchEvent(new Event("input", { bubbles: true }));
            await new Promise(requestAnimationFrame);
          }
          return (flyball.live.runs - before) / seconds;
        }""",
        SECONDS,
    )
    box = tab.locator(".stage").bounding_box()
    x, y = tab.evaluate("(name) => flyball.pixel(name)", body)
    tab.mouse.move(box["x"] + x, box["y"] + y)
    tab.mouse.down()
    before, began = tab.evaluate("flyball.live.pictures"), time.monotonic()
    k = 0
    while time.monotonic() - began < SECONDS:
        k += 1
        tab.mouse.move(box["x"] + x + 20 * (k % 9), box["y"] + y + 15 * (k % 7))
    dragged = (tab.evaluate("flyball.live.pictures") - before) / (time.monotonic() - began)
    tab.mouse.up()
    tab.click("[name=run-live]")
    tab.wait_for_timeout(500)
    before = tab.evaluate("flyball.live.pictures")
    tab.wait_for_timeout(1000 * SECONDS)
    stepped = (tab.evaluate("flyball.live.pictures") - before) / SECONDS
    return runs, dragged, stepped


def main() -> None:
    """Print a table."""
    print(f"{'example':<22} {'session [ms]':>12} {'runs [1/s]':>11} {'dragged':>9} {'stepped':>9}")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for name in sys.argv[1:] or NAMES:
            m = fb.load(EXAMPLES / f"{name}.toml")
            alone = session_ms(m)
            server = LiveServer(lambda m=m: m, options())  # type: ignore[misc]
            thread = server.start()
            tab = browser.new_page(viewport={"width": 1280, "height": 800})
            tab.goto(f"{server.address}#t=0")
            tab.wait_for_selector("body[data-ready]")
            runs, dragged, stepped = rates(tab, m.bodies[0].name)
            tab.close()
            server.stop()
            thread.join()
            print(f"{name:<22} {alone:>12.1f} {runs:>11.1f} {dragged:>9.1f} {stepped:>9.1f}", flush=True)
        browser.close()


if __name__ == "__main__":
    main()
