"""Pictures drawn by a second process while this one computes and writes the rest.

Importing Matplotlib and drawing take longer than a short motion. The second process gets numbers and names, never the
result; whatever goes wrong in it, this one draws the pictures itself, so that a user is told the same.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from threading import Thread
from typing import Any

from .artist import draw, files
from .recording import Picture
from .second_process import cores, started


class Artist:
    """Draws pictures beside this process while its ``with`` block lasts; not ``beside``, or on one core, within it."""

    def __init__(self, beside: bool = True) -> None:
        self._process = _started() if beside else None
        self._asked: tuple[Sequence[Picture], Path] | None = None
        self._talk: Thread | None = None

    def __enter__(self) -> Artist:
        return self

    def begin(self, pictures: Sequence[Picture], folder: Path) -> None:
        """Ask for pictures, once, to be drawn as PNG files into a folder that is there."""
        self._asked = pictures, folder
        if self._process is not None:
            self._talk = Thread(target=self._process.communicate, args=(pickle.dumps(self._asked),))
            self._talk.start()

    def finish(self) -> list[Path]:
        """Wait until they are drawn; returns their paths, none if none were asked for.

        Raises
        ------
        ModelError
            If a file cannot be written.
        """
        if self._asked is None:
            return []
        if self._process is not None and self._talk is not None:
            self._talk.join()
            if self._process.returncode == 0:
                return files(*self._asked)
        return draw(*self._asked)

    def __exit__(self, *_: Any) -> None:
        if self._process is not None:
            self._process.kill()
            if self._talk is not None:
                self._talk.join()
            else:
                self._process.communicate()


def loaded() -> bool:
    """Whether this process has Matplotlib: then it draws sooner than another would."""
    return "matplotlib" in sys.modules


def _started() -> subprocess.Popen | None:
    """The second process, importing already; None where it would not help, or cannot be had."""
    return None if cores() < 2 or loaded() else started("flyball.view.artist")
