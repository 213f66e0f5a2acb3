"""Where a motion is kept on its way: one result file, and files beside it of what came since that was written.

A file that is there is whole: each is written beside its place and then put there. The first file is written anew once
the others hold as much as it does, so that all that is ever written is some three times the result, and no write is
longer than what was computed since takes to write, or once in a while all.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import ModelError
from ...model.model import Model
from ...results.files import save
from ...results.joined import joined
from ...results.reading import load_result
from ...results.result import Result
from .whole import finished

EVERY = 20.0  # seconds between two writes, at least
MOST = 60  # files beside the first one
NOTE = "checkpoint"  # in `Result.carried`
OTHER = "give another file, or remove that one"


class Keeper:
    """Parts of a motion and the files that hold them.

    Parameters
    ----------
    path : Path
    mark : str
        What tells the motion from others.
    times : ndarray [s]
        Output times of the whole motion.

    Attributes
    ----------
    parts : list of Result
        As far as it is computed; several that are written may be one.
    by : str
        Why it goes by steps of impulses after all, if it does.
    """

    def __init__(self, path: Path, mark: str, times: np.ndarray) -> None:
        self.path, self.mark, self.times = path, mark, times
        self.parts: list[Result] = []
        self.by = ""
        self._run, self._count, self._written = uuid.uuid4().hex, 0, 0  # parts in all, and those in files
        self._first = self._beside = 0  # times in the first file, and in those beside it
        self._files: list[Path] = []
        self._last = time.monotonic()

    def read(self, cls: type[Model]) -> bool:
        """Take what the files hold; whether it is the whole motion.

        Raises
        ------
        ModelError
            If the file is something else, damaged, or of another motion.
        """
        if not self.path.exists():
            return False
        found = load_result(self.path, cls)
        told = found.carried.get(NOTE)
        if told is None:
            raise ModelError(f"{self.path} is a result, but not one that was kept with checkpoint=; {OTHER}")
        if told["mark"] != self.mark:
            raise ModelError(
                f"{self.path} is of another motion than this: model, values, options or the version of flyball are not "
                f"the same. To go on from where it ended give start=fb.load_result(...); else {OTHER}"
            )
        self._run, self._count, self.by = told["run"], told["parts"], told["by"]
        self.parts, self._first = [found], len(found.t)
        while (path := self._place(self._count + 1)).exists():
            more = load_result(path, cls)
            told = more.carried.get(NOTE, {})
            if told.get("run") != self._run:
                break
            self.parts.append(more)
            self._files.append(path)
            self._count, self._beside = told["parts"], self._beside + len(more.t)
        self._written = len(self.parts)
        return bool(self.parts[-1].carried[NOTE]["done"])

    def add(self, part: Result) -> None:
        """One more part; it is written if that is due."""
        self.parts.append(part)
        self._count += 1
        if time.monotonic() - self._last > EVERY:
            self.write()

    def anew(self, by: str) -> None:
        """The motion begins once more, another way."""
        self.parts, self.by, self._run = [], by, uuid.uuid4().hex
        self._count = self._written = self._first = self._beside = 0
        self._forget()

    def write(self) -> None:
        """Write what is not in files yet."""
        new = self.parts[self._written :]
        if not new:
            return
        rows = sum(len(p.t) for p in new)
        if self._beside + rows >= self._first or len(self._files) >= MOST:
            self.parts = [self._joined(self.parts)]
            self._save(self.path, self.parts[0])
            self._forget()
            self._first, self._beside = len(self.parts[0].t), 0
        else:
            self.parts[self._written :] = [self._joined(new)]
            place = self._place(self._count - len(new) + 1)
            self._save(place, self.parts[-1])
            self._files.append(place)
            self._beside += rows
        self._written, self._last = len(self.parts), time.monotonic()

    def whole(self, *last: Result) -> Result:
        """All with what was computed last."""
        return self._joined([*self.parts, *last])

    def finish(self, result: Result) -> None:
        """Write the whole motion, as other programs read it too, and nothing beside it."""
        self._save(self.path, result, done=True)
        self._forget()

    def _joined(self, parts: Sequence[Result]) -> Result:
        return finished(joined(parts, self.times), parts)

    def _save(self, path: Path, result: Result, done: bool = False) -> None:
        result.carried[NOTE] = {
            "mark": self.mark, "run": self._run, "parts": self._count, "by": self.by, "done": done
        }  # fmt: skip
        save(result, path, whole=done)

    def _place(self, part: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{part}")

    def _forget(self) -> None:
        """Remove the files beside the first one, those of an earlier motion too."""
        for path in self.path.parent.glob(f"{self.path.name}.*"):
            if path.name.removeprefix(f"{self.path.name}.").isdigit():
                path.unlink(missing_ok=True)
        self._files = []
