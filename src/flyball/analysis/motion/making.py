"""Code made by another process, which leaves it on disk, while this one computes motions without it.

That process is handed the mechanism and makes ready what this one has made ready. Whatever goes wrong in it, this one
finds nothing on disk and makes the code itself, later.
"""

from __future__ import annotations

import atexit
import pickle
import subprocess
import sys
import threading
from contextlib import suppress

from ... import special
from ...compiler.second import cores, is_one_of_many, started
from ..compiled import Compiled, compiled

_asked: dict[str, subprocess.Popen | None] = {}  # by kind of mechanism
_lock = threading.Lock()


def made_beside(kind: str, c: Compiled) -> bool:
    """Whether another process is making the code; it is started if it was not yet. One at a time, one for each kind."""
    with _lock:
        if kind not in _asked:
            if any(p is not None and p.poll() is None for p in _asked.values()):
                return True  # when that one has ended
            _asked[kind] = _start(c)
        process = _asked[kind]
        return process is not None and process.poll() is None


def _start(c: Compiled) -> subprocess.Popen | None:
    """A process that makes it; None where there is none to be had, or the mechanism cannot be handed on."""
    s = c.structure
    if cores() < 2 or is_one_of_many() or not special.kept():
        return None
    try:
        asked = pickle.dumps((s.model, c.parameters, s.tree))
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    process = started("flyball.analysis.motion.making", stderr=subprocess.DEVNULL)
    if process is not None and process.stdin is not None:
        with suppress(OSError):  # it has ended
            process.stdin.write(asked)
            process.stdin.close()
    return process


@atexit.register
def _end() -> None:
    for process in _asked.values():
        if process is not None and process.poll() is None:
            process.kill()
            process.wait()


def main() -> None:
    """What the other process does."""
    model, parameters, tree = pickle.load(sys.stdin.buffer)
    c = compiled(model.snapshot(), parameters=parameters, tree=tree)
    plan = special.plan(c)
    if not plan.refused:
        special.code(plan, c)
