"""What a fresh process imports: nothing that it does not need, by stages from the description to the files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
HEAVY = ("h5py", "matplotlib", "numba", "pandas", "pint", "rich", "scipy", "sympy", "typer", "xarray")
REPORT = f"""
import json, sys
found = {{}}
def note(stage):
    found[stage] = [name for name in {HEAVY!r} if name in sys.modules]
"""
STAGES = f"""{REPORT}
import flyball as fb
note("import")
m = fb.load(sys.argv[1])
note("describe")
run = m.simulate(float(sys.argv[2]))
note("simulate")
for name in run.names():
    run[name]
run.energy.total, str(run.events)
note("read")
str(run), str(run.health)
note("print")
from flyball.compiler.formulas import KERNELS
if any(kernel.origin == "compiled" for kernel in KERNELS):
    found = {{stage: [name for name in names if name != "numba"] for stage, names in found.items()}}
print(json.dumps(found))
"""
COMMAND = f"""{REPORT}
from flyball.cli import main
try: main(sys.argv[1:])
except SystemExit as end: assert not end.code
note("run")
print(json.dumps(found["run"]))
"""


def process(code: str, *arguments: object) -> list | dict:
    """What a fresh process prints last, as JSON."""
    ended = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=600
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout.splitlines()[-1])


@pytest.mark.parametrize(
    ("name", "t_end"),
    [
        ("governor", 0.1),
        ("slider_crank", 0.1),
        ("point_mass_pendulum", 0.1),
        ("spatial_four_bar", 0.1),
        ("geneva_drive", 0.05),  # whose drawn position has to be closed
        ("thin_rod", 0.1),  # whose inertias are looked at
        ("clutch_start", 0.1),  # friction that sticks and slips
        ("rope_pendulum", 0.1),  # guards
        ("rocking_block", 0.1),  # contact
    ],
)
def test_a_simulation_imports_numpy_and_little_else(name: str, t_end: float) -> None:
    """Numba only where a kernel had to be compiled: that it is not needed for others is what the wheel is for."""
    found = process(STAGES, EXAMPLES / f"{name}.toml", t_end)
    assert found == {stage: [] for stage in ("import", "describe", "simulate", "read", "print")}


def test_a_table_is_described_without_scipy() -> None:
    code = f"{REPORT}import flyball as fb; m = fb.Mechanism('m', planar=True)\n"
    code += "m.add(fb.Table('f', x=(0, 1, 2, 3), y=(0, 1, 4, 9), interpolation='monotone')); note('table')\n"
    assert process(f"{code}print(json.dumps(found['table']))") == []


def test_the_command_writes_its_files_without_matplotlib_and_xarray(tmp_path: Path) -> None:
    words = ["run", EXAMPLES / "slider_crank.toml", "--t-end", "0.1", "--out", tmp_path, "--quiet"]
    found = process(COMMAND, *words)
    assert {"matplotlib", "pandas", "pint", "scipy", "xarray"}.isdisjoint(found)
    assert sorted(os.listdir(tmp_path)) == ["animation.html", "report.html", "result.csv", "result.nc"]
