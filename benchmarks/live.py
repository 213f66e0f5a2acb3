"""Live pages: time from a new value to the packed motion, and pictures a second while stepping, for every example.

``run`` is the time from a new value of a slider to the packed motion of 5 s at 501 times, ``step`` that from one
picture to the next while the mechanism is stepped at the speed at which its page opens (the median, and the longest in
50), both of the session, without a browser; ``rate`` is the number of such pictures a second, of 30 at most, and after
it stands what the page says of a slow model, or why an example cannot be stepped.

``--browser`` serves the named examples, opens their pages in Chromium (with software graphics where there is no other),
and works on them as a hand does, for two seconds each: pictures a second while a slider moves, while a body is dragged,
while it is stepped.

Usage: ``python live.py``; names of examples as arguments.
"""

from __future__ import annotations

import argparse
import json
import runpy
import shutil
import time
from pathlib import Path
from typing import Any

import flyball as fb
from flyball.live import LiveOptions
from flyball.live.session import LiveSession

EXAMPLES = Path(__file__).parent.parent / "examples"
IN_BROWSER = ("slider_crank", "quick_return", "governor", "double_wishbone", "stick_slip", "rope_pendulum", "stewart")
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SECONDS = 2.0
LONG = {"andrews": 0.03, "wrecking_ball": 0.5}
"""Duration of the motion [s] of examples whose own time is short."""


def options(name: str = "") -> LiveOptions:
    return LiveOptions(t_end=LONG.get(name, 5.0), outputs=501, ranges=None, port=0, no_open=True)


def example(name: str) -> fb.Mechanism | None:
    """The mechanism of an example; None if the file makes none by itself."""
    path = next(EXAMPLES / f"{name}{end}" for end in (".toml", ".py", ".urdf") if (EXAMPLES / f"{name}{end}").exists())
    if path.suffix != ".py":
        return fb.load(path)
    make = runpy.run_path(str(path)).get("mechanism")
    return make() if make else None


def run_seconds(session: LiveSession) -> float:
    """Time from a new value to the packed motion, the median of five; of a slow one a single time."""
    took: list[float] = []
    name, slider = next(iter(session.sliders.items()), ("", None))
    for k in range(5):
        if slider is None:
            session.receive('{"do": "reset"}')
        else:
            session.receive(json.dumps({"do": "set", "name": name, "value": slider.value * (1.0 + 1e-3 * k)}))
        began = time.perf_counter()
        list(session.work())
        took.append(time.perf_counter() - began)
        if sum(took) > SECONDS:
            break
    return sorted(took)[len(took) // 2]


def stepped(session: LiveSession) -> tuple[list[float], str]:
    """Times of the session for one picture [s], and what it says of its speed, while stepping."""
    session.receive('{"do": "start"}')
    kinds = [read(message) for message in session.work()]
    if kinds[-1]["kind"] == "error":
        raise fb.ModelError(kinds[-1]["text"])
    session.receive(json.dumps({"do": "speed", "value": session.playback_speed}))
    took: list[float] = []
    slow, began = "", time.perf_counter()
    while time.perf_counter() - began < SECONDS:
        time.sleep(session.wait() or 0.0)
        here = time.perf_counter()
        sent = [read(message) for message in session.work()]
        took.append(time.perf_counter() - here)
        if any(x["kind"] == "error" for x in sent):
            raise fb.SimulationError(next(x["text"] for x in sent if x["kind"] == "error"))
        slow = next((x["slow"] for x in sent if x.get("slow")), slow)
        session.receive('{"do": "shown"}')
    return took, slow


def read(message: bytes) -> dict[str, Any]:
    """The JSON object of a message."""
    return json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])


def sessions(names: list[str]) -> None:
    """Print a table of sessions without a browser."""
    print(f"{'example':<28} {'run [ms]':>9} {'step [ms]':>10} {'longest':>8} {'rate [1/s]':>11}")
    for name in names:
        m = example(name)
        if m is None:
            continue
        session = LiveSession(lambda m=m: m, options(name))  # type: ignore[misc]
        list(session.work())
        print(f"{name:<28} {1e3 * run_seconds(session):>9.1f}", end=" ", flush=True)
        try:
            took, slow = stepped(session)
        except fb.FlyballError as error:
            print(f"not stepped: {str(error).partition(';')[0][:90]}", flush=True)
            continue
        middle, longest = 1e3 * sorted(took)[len(took) // 2], 1e3 * max(took[1:51], default=0.0)
        print(f"{middle:>10.1f} {longest:>8.1f} {len(took) / SECONDS:>11.1f} {slow}", flush=True)


def rates(tab: Any, body: str) -> tuple[float, float, float]:
    """Pictures a second on a page: of runs, of dragging, of stepping."""
    runs = tab.evaluate(
        """async (seconds) => {
          const slider = document.querySelector(".parameter input[type=range]");
          if (!slider) return NaN;
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
    return runs, dragged, (tab.evaluate("flyball.live.pictures") - before) / SECONDS


def pages(names: list[str]) -> None:
    """Print a table of pages in Chromium."""
    from playwright.sync_api import sync_playwright

    from flyball.live.server import LiveServer

    print(f"{'example':<28} {'runs [1/s]':>11} {'dragged':>9} {'stepped':>9}")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for name in names:
            m = example(name)
            if m is None:
                continue
            server = LiveServer(lambda m=m: m, options(name))  # type: ignore[misc]
            thread = server.start()
            tab = browser.new_page(viewport={"width": 1280, "height": 800})
            tab.goto(f"{server.address}#t=0")
            tab.wait_for_selector("body[data-ready]")
            runs, dragged, stepped = rates(tab, m.bodies[0].name)
            tab.close()
            server.stop()
            thread.join()
            print(f"{name:<28} {runs:>11.1f} {dragged:>9.1f} {stepped:>9.1f}", flush=True)
        browser.close()


def main() -> None:
    """Print a table."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("names", nargs="*")
    arguments.add_argument("--browser", action="store_true")
    given = arguments.parse_args()
    every = sorted(p.stem for p in EXAMPLES.iterdir() if p.suffix in (".toml", ".py", ".urdf"))
    if given.browser:
        pages(given.names or list(IN_BROWSER))
    else:
        sessions(given.names or list(dict.fromkeys(every)))


if __name__ == "__main__":
    main()
