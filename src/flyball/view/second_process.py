"""Other processes of this program, which do beside this one what it would wait for."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import IO, Any

# Modules are found where this process finds them, and an interrupt is this process' to answer.
CODE = """import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.path[:] = {path!r}
from {module} import main
main()
"""


def started(module: str, out: int | IO = subprocess.DEVNULL, **more: Any) -> subprocess.Popen | None:
    """A process that runs ``main`` of a module, fed through its input; None where there is none to be had."""
    if getattr(sys, "frozen", False) or not sys.executable:
        return None
    command = [sys.executable, "-P", "-c", CODE.format(path=sys.path, module=module)]
    try:
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=out, **more)
    except OSError:
        return None


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
