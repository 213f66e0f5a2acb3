"""A headless Chromium for the tests of the pages; where there is none they are skipped, and say so."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: no browser can be driven"
    )
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("chromium is not installed: the page cannot be opened")
    with sync_api.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=FLAGS)
        yield browser
        browser.close()


class Opened:
    """A page that has been opened, and everything that went wrong or out on it."""

    def __init__(self, browser: Any, address: str, script: str = "", **options: Any) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self.tab = browser.new_page(viewport={"width": 800, "height": 540}, offline=True, **options)
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("pageerror", lambda error: self.errors.append(error.message))
        self.tab.on("console", lambda said: said.type in ("error", "warning") and self.errors.append(said.text))
        if script:
            self.tab.add_init_script(script)
        self.tab.goto(address)
        self.tab.wait_for_selector("body[data-ready]", timeout=300_000)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.tab, name)

    @property
    def time(self) -> float:
        return self.tab.evaluate("flyball.time()")

    @property
    def foreign(self) -> list[str]:
        """Addresses asked for that are not in the page itself."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))]

    def wait_until(self, reached: Callable[[], bool]) -> None:
        for _ in range(100):
            if reached():
                return
            self.tab.wait_for_timeout(50)
        raise AssertionError(f"not reached within 5 s; the time is {self.time}")

    def settle(self) -> None:
        """Wait until what has changed is drawn: two frames."""
        self.tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def poses(self, time: float) -> np.ndarray:
        return np.array(self.tab.evaluate("(t) => (flyball.seek(t), flyball.pose())", float(time)))

    def picture(self) -> np.ndarray:
        """The drawn canvas as (height, width, 3) of int, without what lies over it."""
        from PIL import Image

        self.tab.add_style_tag(content=".stage > :not(canvas) { visibility: hidden !important; }")
        self.settle()
        data = self.tab.locator(".stage").screenshot()
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Callable[..., Opened]]:
    """Opens a document: ``opened(text, "t=0")``."""
    tabs: list[Opened] = []

    def open_page(document: str, wish: str = "t=0", script: str = "", **options: Any) -> Opened:
        path = tmp_path / "page.html"
        path.write_text(document, encoding="utf-8")
        tabs.append(Opened(browser, f"{path.as_uri()}#{wish}", script, **options))
        return tabs[-1]

    yield open_page
    for tab in tabs:
        tab.close()
