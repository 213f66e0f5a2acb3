"""Ahead-of-time compilation of all kernels on all cores, for ``flyball compile`` and for the wheel with object code."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from subprocess import PIPE
from threading import Lock
from typing import TextIO

from .formulas import KERNELS, PACKAGE, compiled_files
from .kernels import Kernel
from .object_code import baseline, compile_kernel
from .object_files import COSTS, DEFAULT_COST, cache_folder, file_name, read_object, write_object

_DECORATED = re.compile(r"^@(first_order_|vectorised_)?kernel$", re.MULTILINE)
# Child processes find modules where this process does, and leave interrupts to it.
_WORKER = """import signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.path[:] = {path!r}
from flyball.compiler.ahead_of_time import work
work()
"""


def all_kernels() -> list[Kernel]:
    """Kernels of flyball, those that take longest first."""
    for file in sorted(compiled_files()):
        if _DECORATED.search(file.read_text(encoding="utf-8")):
            import_module(".".join(("flyball", *file.relative_to(PACKAGE).with_suffix("").parts)))
    own = [k for k in KERNELS if k.name.startswith("flyball.")]
    return sorted(own, key=lambda k: -COSTS.get(k.__qualname__, DEFAULT_COST)[1])


def missing_kernels(folder: Path, cpus: Sequence[str]) -> list[Kernel]:
    """Kernels whose object code is missing, at least in part, from a folder."""
    return [k for k in all_kernels() if any(read_object(folder / file_name(k, cpu)) is None for cpu in cpus)]


def compile_all(
    folder: Path | None = None, cpus: Sequence[str] = (), progress: Callable[[str, int, int], None] | None = None
) -> int:
    """Compile the kernels that a folder lacks, shared among processes.

    Parameters
    ----------
    folder : Path
        By default the user's.
    cpus : sequence of str
        See `object_code.BASELINES`; by default this machine's.
    progress : function
        Called with the name of a kernel that is ready, how many are, and how many there are in all.

    Returns
    -------
    int
        Number of kernels compiled.

    Raises
    ------
    OSError
        If the folder cannot be written.
    RuntimeError
        If a kernel cannot be compiled, with the end of that process's output.
    """
    folder, cpus = folder or cache_folder(), cpus or (baseline(),)
    if folder is None:
        raise OSError("there is no folder that compiled code can be kept in; FLYBALL_CACHE names one")
    folder.mkdir(parents=True, exist_ok=True)
    todo = [k.name for k in missing_kernels(folder, cpus)]
    work = _SharedWork(folder, cpus, todo[::-1], len(todo), progress)
    with ThreadPoolExecutor(max_workers=max(1, min(available_cores(), work.total))) as pool:
        for future in [pool.submit(work.serve) for _ in range(min(available_cores(), work.total))]:
            future.result()
    if work.failures:
        raise RuntimeError(work.failures[0])
    return work.total


@dataclass
class _SharedWork:
    """Kernels to be compiled, from which each process takes the next one."""

    folder: Path
    cpus: Sequence[str]
    left: list[str]
    total: int
    progress: Callable[[str, int, int], None] | None
    ready: int = 0
    failures: list[str] = field(default_factory=list)
    lock: Lock = field(default_factory=Lock)

    def serve(self) -> None:
        """Run one process that compiles kernels until none is left or one fails."""
        with tempfile.TemporaryFile("w+", encoding="utf-8") as errors:  # a full pipe would stop the process
            self._share_with(errors)

    def _share_with(self, errors: TextIO) -> None:
        """Give kernels to a process that writes its errors to a file."""
        code = _WORKER.format(path=sys.path)
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code], stdin=PIPE, stdout=PIPE, stderr=errors, text=True, bufsize=1
        )
        give, answers = process.stdin, process.stdout
        assert give is not None
        assert answers is not None
        give.write(f"{self.folder}\n{' '.join(self.cpus)}\n")
        while not self.failures:
            with self.lock:
                name = self.left.pop() if self.left else None
            if name is None:
                break
            give.write(f"{name}\n")
            if answers.readline().strip() != name:
                process.communicate()
                errors.seek(0)
                self.failures.append(f"{name} cannot be compiled: {errors.read()[-1000:]}")
                return
            with self.lock:
                self.ready += 1
                if self.progress is not None:
                    self.progress(name, self.ready, self.total)
        process.communicate()


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def work() -> None:
    """Main function of a child process: compile the kernels whose names it reads, one on each line."""
    folder, cpus = Path(sys.stdin.readline().strip()), tuple(sys.stdin.readline().split())
    known = {k.name: k for k in all_kernels()}
    for line in sys.stdin:
        kernel = known[line.strip()]
        for cpu, code in zip(cpus, compile_kernel(kernel, cpus), strict=True):
            write_object(folder / file_name(kernel, cpu), code)
        print(kernel.name, flush=True)
