"""One thread, CPU clocks and text tables for every benchmark. Import before numpy: it fixes the thread counts.

Times are CPU times of the process, because a shared machine's wall clock mostly measures the neighbours.
"""

from __future__ import annotations

import gc
import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_variable] = "1"

PACKAGES = ("numpy", "scipy", "numba", "exudyn", "mujoco", "pin", "drake", "scikit-sundae")


def cpu(work: Callable[[], Any]) -> float:
    """CPU seconds of one call."""
    start = time.process_time()
    work()
    return time.process_time() - start


def interleaved(clocks: Mapping[str, Callable[[], float]], repeats: int) -> dict[str, float]:
    """Median of ``repeats`` readings of every clock, taken in turn so that a busy spell hits all of them.

    What one reading leaves as garbage is collected before the next, and not on its account.

    Parameters
    ----------
    clocks : mapping
        Name -> function that does the work once and returns its CPU seconds.
    repeats : int
    """
    readings: dict[str, list[float]] = {name: [] for name in clocks}
    gc.collect()
    gc.freeze()
    for _ in range(repeats):
        for name, clock in clocks.items():
            gc.collect()
            readings[name].append(clock())
    gc.unfreeze()
    return {name: statistics.median(r) for name, r in readings.items()}


def machine() -> dict[str, Any]:
    """Class of the machine, load and versions: what a figure needs beside it (no host name)."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "")
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return {
        "date": date.today().isoformat(),
        "processor": model or platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "versions": found,
    }


@lru_cache(maxsize=1)
def heading() -> str:
    """The machine and the versions in a line."""
    m = machine()
    versions = ", ".join(f"{name} {number}" for name, number in m["versions"].items())
    return f"{m['date']}, {m['processor']}, {m['cores']} cores, load {m['load']}, Python {m['python']}, {versions}"


def text(value: Any) -> str:
    """A cell of a table: three digits of a number with a fraction, nothing for None."""
    if isinstance(value, float):
        return f"{value:.3g}"
    return "" if value is None else str(value)


def table(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str]) -> str:
    """Rows as aligned text.

    Parameters
    ----------
    rows : sequence of mappings
    columns : mapping
        Key of a row -> heading.
    """
    cells = [list(columns.values())] + [[text(row.get(key)) for key in columns] for row in rows]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    lines = [
        "  ".join(c.rjust(w) if i else c.ljust(w) for i, (c, w) in enumerate(zip(line, widths, strict=True)))
        for line in cells
    ]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])


def write_json(path: str | None, rows: Sequence[Mapping[str, Any]]) -> None:
    """Rows and machine into a file, if one is asked for."""
    if path:
        Path(path).write_text(json.dumps({"machine": machine(), "rows": list(rows)}, indent=1) + "\n")
