"""Code made for one mechanism against the table-driven engine: right-hand sides and whole time loops, side by side.

Run from the project's root: ``python benchmarks/specialised.py [mechanism ...]``. Right-hand sides are taken at the
start of the motion, projection and refinement included; loops are those of ``simulate`` without the rest.
"""

from __future__ import annotations

import sys
from typing import Any

import timing  # isort: skip  (before numpy: it fixes the thread counts)
import numpy as np

from flyball import codegen
from flyball.compiler.formulas import formula
from flyball.compiler.kernels import kernel
from flyball.compiler.struct_layout import Float1
from flyball.engine.entry_point import allocate_work
from flyball.engine.motion import STAGES, derivative
from flyball.tables.table_definitions import SAMPLED, System, Work
from mechanisms import Kernel, example

MECHANISMS = {
    "andrews.toml": 0.05,
    "bricard.toml": 10.0,
    "spatial_four_bar.toml": 5.0,
    "double_wishbone.toml": 2.0,
    "stewart.py": 2.0,
}
"""Files of the examples, and how long they move [s]."""
COLUMNS = {
    "name": "mechanism", "made": "made in [s]", "operations": "operations", "tables": "tables [us]",
    "code": "code [us]",
    "ratio": "times", "differs": "differs by", "loop": "loop [ms]", "code_loop": "code [ms]", "loop_ratio": "times",
}  # fmt: skip


@formula
def again(S, W, y, dy, n):
    """Right-hand sides at one state."""
    status = 0
    for _ in range(n):
        status = max(status, derivative(0.0, y, dy, S, W))
    return status


@kernel
def right_hand_sides(S: System, W: Work, y: Float1, dy: Float1, n: int) -> int:
    """`again`, compiled."""
    return again(S, W, y, dy, n)


def microseconds(s: Any, S: Any, y: np.ndarray, calls: int = 20000) -> tuple[float, np.ndarray]:
    """Of a right-hand side, and what it is."""
    W, dy = allocate_work(s, S), np.zeros(len(y))
    W.generated[1:SAMPLED] = S.flat[1:SAMPLED]
    (
        W.options.stabilization,
        W.options.solve_tolerance,
        W.options.position_tolerance,
        W.options.velocity_tolerance,
    ) = STAGES, 1e-13, 1e-10, 1e-9
    run = right_hand_sides
    if run(S, W, y, dy, 1) != 0:
        raise RuntimeError("the right-hand side has no value")
    return min(timing.cpu(lambda: run(S, W, y, dy, calls)) for _ in range(7)) / calls * 1e6, dy


def row(name: str, t_end: float) -> dict[str, Any]:
    """A mechanism's line of the table."""
    loops = [Kernel(example(name), t_end, 20) for _ in range(2)]
    c = loops[1].start.assembly.compiled
    x, y = c.values, loops[1].start.y
    made, _ = codegen.code(codegen.plan(x), x)
    S = made.system(x.system)
    tables, dy = microseconds(x.structure, x.system, y)
    code, own = microseconds(x.structure, S, y)
    c.system = S
    c.work = c.work._replace(flat=np.zeros(made.scratch))
    seconds = [[], []]
    for _ in range(9):
        for k, loop in enumerate(loops):
            seconds[k].append(loop.seconds())
    first, second = (1e3 * min(t[1:]) for t in seconds)
    return {
        "name": name, "made": made.seconds, "operations": made.operations, "tables": tables, "code": code,
        "ratio": tables / code, "differs": float(np.abs(dy - own).max() / np.abs(dy).max()), "loop": first,
        "code_loop": second, "loop_ratio": first / second,
    }  # fmt: skip


def main(names: list[str]) -> None:
    """Print the table."""
    print(timing.heading())
    print(timing.table([row(n, MECHANISMS[n]) for n in names or MECHANISMS], COLUMNS))


if __name__ == "__main__":
    main(sys.argv[1:])
