"""Build hook: with ``FLYBALL_OBJECTS=1`` a wheel brings the object code of every kernel, and compiles none when used.

``FLYBALL_OBJECTS`` may also list processors (``x86-64-v3,x86-64-v2``); with 1 it is those of this machine's family.
Making them takes some minutes. The wheel is then one for this system; without the variable it is plain Python.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent


class ObjectsHook(BuildHookInterface):
    """Makes the object code, and puts it and the platform's tag into the wheel."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """What compiling needs: flyball's own dependencies, only where object code is wanted."""
        return list(self.metadata.core.dependencies) if _wanted() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile every kernel, on all cores."""
        wanted = _wanted()
        if not wanted or version == "editable":
            return
        sys.path.insert(0, str(ROOT / "src"))
        from flyball.compiler.ahead_of_time import all_kernels, compile_all
        from flyball.compiler.object_code import baselines
        from flyball.compiler.object_files import file_name

        cpus = baselines() if wanted == "1" else tuple(wanted.split(","))
        folder = ROOT / "build" / "objects"  # what is there of the same sources is taken

        def progress(name: str, done: int, total: int) -> None:
            self.app.display_info(f"object code {done} of {total}: {name}")

        self.app.display_info(f"compiling every kernel for {', '.join(cpus)}: some minutes")
        compile_all(folder, cpus, progress)
        for name in (file_name(kernel, cpu) for kernel in all_kernels() for cpu in cpus):
            build_data["force_include"][str(folder / name)] = f"flyball/objects/{name}"
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform_tag()}"


def _wanted() -> str:
    given = os.environ.get("FLYBALL_OBJECTS", "")
    return "" if given == "0" else given


def platform_tag() -> str:
    """Of a wheel with object code: this system and architecture. The objects use C's mathematics library only."""
    tag = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return tag.replace("linux_", "manylinux_2_17_", 1) if tag.startswith("linux_") else tag
