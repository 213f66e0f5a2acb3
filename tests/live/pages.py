"""A page without a browser: what a session sends, read back."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import flyball as fb
from flyball.live.options import LiveOptions
from flyball.live.session import LiveSession

FOUR_BAR = Path(fb.__file__).parent / "models" / "four-bar.toml"
NUMBERS = {"f8": 8, "f4": 4}


def options(**given: Any) -> LiveOptions:
    return LiveOptions(**{"t_end": 1.0, "outputs": 101, "ranges": None, "port": 0, "no_open": True} | given)


def read(message: bytes) -> dict[str, Any]:
    """The object of a message; its recording, if there is one, with arrays (n, k) in place of references."""
    (length,) = struct.unpack_from("<I", message)
    content = json.loads(message[4 : 4 + length])
    content["recording"] = read_recording(message[4 + length :])
    return content


def read_recording(data: bytes) -> dict[str, Any] | None:
    if not data:
        return None
    (length,) = struct.unpack_from("<I", data)
    start = -(-(4 + length) // 8) * 8

    def resolved(item: dict[str, Any]) -> Any:
        if set(item) != {"at", "count", "type"} or item["type"] not in NUMBERS:
            return item
        width = NUMBERS[item["type"]]
        raw = np.frombuffer(data, np.uint8, width * item["count"], start + item["at"])
        return raw.reshape(width, -1).T.copy().view(f"<f{width}").ravel()

    return json.loads(data[4 : 4 + length], object_hook=resolved)


class Page:
    """A session and what it has sent, by kind the newest."""

    def __init__(self, load: Callable[[], fb.Mechanism] | fb.Mechanism, file: Path | None = None, **given: Any) -> None:
        self.session = LiveSession(load if callable(load) else lambda: load, options(**given), file)
        self.newest: dict[str, dict[str, Any]] = {}
        self.kinds: list[str] = []
        self.work()

    def work(self, poll: Callable[[], None] = lambda: None) -> list[str]:
        """Let the session work; return the kinds of its messages."""
        kinds = []
        for message in self.session.work(poll):
            content = read(message)
            kinds.append(content["kind"])
            self.newest[content["kind"]] = content
        return kinds

    def ask(self, do: str, **more: Any) -> list[str]:
        self.session.receive(json.dumps({"do": do, **more}))
        return self.work()

    def drag(self, body: str, at: list[float], to: list[float], by: str = "assembly", t: float = 0.0) -> list[str]:
        return self.ask("drag", body=body, at=at, to=to, by=by, t=t)

    def channel(self, name: str, kind: str = "run") -> np.ndarray:
        return next(c["values"] for c in self.newest[kind]["recording"]["channels"] if c["name"] == name)

    @property
    def text(self) -> str:
        """The newest error."""
        return self.newest["error"]["text"]
