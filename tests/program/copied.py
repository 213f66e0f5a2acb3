"""Copies of the package, for tests that edit its sources, and processes of their own that run from them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from copy import copy
from pathlib import Path

import flyball

PACKAGE = Path(flyball.__file__).parent

COUNT = """
import json, sys

def cache_counts():
    from flyball.compiler.formulas import KERNELS
    used = [k for k in KERNELS if k.used]
    return {
        "hits": sum(k.origin == "cache" for k in used),
        "misses": sum(k.origin == "compiled" for k in used),
        "kernels": [k.__qualname__ for k in used],
    }
"""


class Copy:
    """The package copied to a folder, with a cache of compiled code of its own."""

    def __init__(self, folder: Path) -> None:
        self.root = folder
        self.package = folder / "flyball"
        self.cache = folder / "cache"
        shutil.copytree(PACKAGE, self.package, ignore=shutil.ignore_patterns("__pycache__"))

    @staticmethod
    def examples() -> Path:
        """Where the example models are."""
        return Path(__file__).resolve().parents[2] / "examples"

    def with_cache(self, folder: Path) -> Copy:
        """The same copy, with another cache of compiled code."""
        other = copy(self)
        other.cache = folder / "cache"
        return other

    def edit(self, path: str, old: str, new: str) -> None:
        """Replace a text that stands in a file exactly once."""
        assert len(old) != len(new), "Python tells bytecode of other sources by their size, and whole seconds"
        file = self.package / path
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{path} has {text.count(old)} times {old!r}"
        file.write_text(text.replace(old, new), encoding="utf-8")

    def add(self, path: str, text: str) -> None:
        """A new file."""
        file = self.package / path
        assert not file.exists()
        file.write_text(text, encoding="utf-8")

    def append(self, path: str, line: str) -> None:
        """A line at the end of a file."""
        file = self.package / path
        file.write_text(file.read_text(encoding="utf-8") + line, encoding="utf-8")

    def changed(self) -> set[str]:
        """Files that differ from those of the package, new ones included."""
        return {
            str(p.relative_to(self.package))
            for p in self.package.rglob("*")
            if p.is_file() and p.suffix != ".pyc" and not self._same(p, PACKAGE / p.relative_to(self.package))
        }

    @staticmethod
    def _same(a: Path, b: Path) -> bool:
        return b.exists() and a.read_bytes() == b.read_bytes()

    def run(self, script: str) -> dict:
        """What a fresh process that imports the copy prints last, as JSON."""
        env = os.environ | {
            "PYTHONPATH": str(self.root),
            "FLYBALL_CACHE": str(self.cache),
        }
        env.pop("PYTHONDONTWRITEBYTECODE", None)  # a process that finds bytecode of the copy is a second quicker
        ended = subprocess.run(
            [sys.executable, "-c", COUNT + script], env=env, cwd=self.root, capture_output=True, text=True, timeout=1800
        )
        assert ended.returncode == 0, ended.stderr
        return json.loads(ended.stdout.splitlines()[-1])
