"""Kernels and doors compiled side by side: by this process, and by others that leave theirs in the cache.

What a motion needs is known before it begins. Where several of that have never been compiled, other processes take one
after the other from the end of the list while this one goes on, and then takes from its beginning. A process is handed
names and empty arrays of the same types. Whatever goes wrong in it, this one finds nothing in the cache and compiles.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from threading import Lock, Thread
from typing import Any

from .door import Door
from .jit import Kernel
from .second import cores, started

MOST = 3  # processes beside this one
Wanted = tuple[Any, tuple[Any, ...]]
"""A door with its tuples, or a kernel with its arguments; only types count."""

_one = Lock()  # motions that begin at once in several threads do not each start processes


class Beside:
    """Compiles what is ``wanted`` while its ``with`` block lasts, beside what this process does there.

    Doors are told at once what they are for: loops that call them may then compile in any order. Doors that stand
    ``behind`` others are only told what for: this process compiles them in the block, or nobody does.

    Attributes
    ----------
    cold : list of int
        What of ``wanted`` has to be compiled.
    left : deque of int
        What nobody has taken yet.
    processes : list
        Those beside this one.
    """

    def __init__(self, wanted: Sequence[Wanted], behind: Sequence[Wanted] = ()) -> None:
        _expect([*behind, *wanted])
        self.wanted, self.behind = wanted, behind
        self.cold = [k for k, (code, _) in enumerate(wanted) if code.cold]
        self.left, self._taking = deque(self.cold), Lock()
        self.processes: list[subprocess.Popen] = []
        self._talks: list[Thread] = []
        self._own = False

    def __enter__(self) -> Beside:
        helpers = min(cores() - 1, MOST, len(self.cold) - 1)
        if helpers > 0 and _kept(self.wanted[self.cold[0]][0]) and not _is_one_of_many():
            self._own = _one.acquire(blocking=False)
        if self._own:
            asked = pickle.dumps([_as_told(self.behind), _as_told(self.wanted)])
            for _ in range(helpers):
                self._start(asked)
        return self

    def _start(self, asked: bytes) -> None:
        process = started("flyball.compiler.beside", subprocess.PIPE, stderr=subprocess.DEVNULL)
        if process is None:
            return
        self.processes.append(process)
        self._talks.append(Thread(target=self._talk, args=(process, asked), daemon=True))
        self._talks[-1].start()

    def _talk(self, process: subprocess.Popen, asked: bytes) -> None:
        """Hand a process one number of the list after the other, until none is left or it ends."""
        talk, answers = process.stdin, process.stdout
        if talk is None or answers is None:
            return
        try:
            talk.write(len(asked).to_bytes(8, "little") + asked)
            talk.flush()
            while answers.readline() and (k := self._take(last=True)) is not None:
                talk.write(b"%d\n" % k)
                talk.flush()
            talk.close()
        except OSError:  # it has ended
            pass

    def _take(self, last: bool) -> int | None:
        with self._taking:
            if not self.left:
                return None
            return self.left.pop() if last else self.left.popleft()

    def finish(self) -> None:
        """Take part until all is compiled."""
        if not self._own:
            return
        while (k := self._take(last=False)) is not None:
            code, tuples = self.wanted[k]
            code.prepare(*tuples)
        for talk in self._talks:
            talk.join()

    def __exit__(self, *_: Any) -> None:
        if self._own:
            self.left.clear()
            for process in self.processes:
                process.kill()
                process.wait()
            for talk in self._talks:
                talk.join()
            for process in self.processes:
                for pipe in (process.stdin, process.stdout):
                    _closed(pipe)
            self._own = False
            _one.release()


def _closed(pipe: Any) -> None:
    with suppress(OSError):  # what it holds for a process that has ended
        pipe.close()


def _kept(code: Door | Kernel) -> bool:
    """Whether what is compiled is kept where other processes find it."""
    from .cache import cache_of

    return bool(getattr(cache_of(code.function), "kept", False))


def _is_one_of_many() -> bool:
    """Whether this is a process that another one has started to share its work."""
    sharing = sys.modules.get("multiprocessing.process")
    return sharing is not None and sharing.parent_process() is not None


def _expect(wanted: Sequence[Wanted]) -> None:
    for code, tuples in wanted:
        if isinstance(code, Door):
            code.expects(*tuples)


def _as_told(wanted: Sequence[Wanted]) -> list[tuple[str, str, tuple[Any, ...]]]:
    """Where each is found, module and name, and its tuples."""
    return [(c.function.__module__, c.function.__qualname__, tuple(map(_emptied, x))) for c, x in wanted]


def _found(told: list[tuple[str, str, tuple[Any, ...]]]) -> list[Wanted]:
    return [(getattr(import_module(module), name), tuples) for module, name, tuples in told]


def _emptied(x: Any) -> Any:
    """The same tuple with empty arrays, and 0 for a number."""
    if isinstance(x, tuple):
        return type(x)(*map(_emptied, x))
    return type(x)() if isinstance(x, int | float) else x[(slice(0, 0),) * x.ndim].copy()


def main() -> None:
    """What the other process does: reads what is wanted, then numbers of it, and answers each with a line."""
    asked, answers = sys.stdin.buffer, sys.stdout
    behind, wanted = map(_found, pickle.loads(asked.read(int.from_bytes(asked.read(8), "little"))))
    _expect([*behind, *wanted])
    print(flush=True, file=answers)
    for line in asked:
        code, tuples = wanted[int(line)]
        code.prepare(*tuples)
        print(flush=True, file=answers)
