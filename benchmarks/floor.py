"""Where the time of one right-hand side goes: operations and bytes it cannot do without, and the time of every part.

Operations are counted by running the same formulas in Python on numbers that count; bytes are those of the mechanism's
tables and of the scratch that is written. Parts are timed in compiled loops of their own. Usage: ``python floor.py``.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

REPEATS, BATCH = 7, 20000
PARTS = {
    "poses": "poses(S, W, q)",
    "rows": "row_values(S, W, 0.0, z)",
    "motions": "motions(S, W, v)",
    "biases": "row_biases(S, W, 0.0, v, z)",
    "forces": (
        "inertial(S, W); forces(S, W, 0.0, dy); gather(S, W, W.velocities.applied); "
        "efforts(S, W, 0.0, dy, W.velocities.applied)"
    ),
    "factor": "factor(S, W)",
    "solve": "solve(S, W, W.velocities.applied, W.rows.gamma, W.velocities.solved, W.rows.multiplier, True, 20)",
    "all": "derivative(0.0, y, dy, S, W)",
}


class Counted:
    """A number that counts what is done with it."""

    __array_ufunc__ = None
    done = 0

    def __init__(self, x: Any) -> None:
        self.x = float(x)

    def __float__(self) -> float:
        return self.x

    def __bool__(self) -> bool:
        return self.x != 0.0

    @property
    def real(self) -> Counted:
        return self

    def __neg__(self) -> Counted:
        return Counted(-self.x)

    def __abs__(self) -> Counted:
        return Counted(abs(self.x))


def _operation(name: str, own: Callable[[float, float], Any], wrap: bool) -> None:
    def operation(self: Counted, other: Any) -> Any:
        Counted.done += wrap
        value = own(self.x, float(other))
        return Counted(value) if wrap else value

    setattr(Counted, name, operation)


for _name, _own in {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "truediv": lambda a, b: a / b if b else float("inf"),
    "pow": lambda a, b: a**b,
}.items():
    _operation(f"__{_name}__", _own, True)
    _operation(f"__r{_name}__", lambda a, b, own=_own: own(b, a), True)
for _name, _own in {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}.items():
    _operation(f"__{_name}__", _own, False)


def counting(function: Callable) -> Callable:
    """A scalar function on counted numbers: one operation, like a product."""

    def counted(*args: Any) -> Any:
        Counted.done += 1
        return Counted(function(*(float(a) for a in args)))

    return counted


def with_counted_functions() -> None:
    """Put counting functions in the place of sin, cos, sqrt, atan2 in every module of flyball."""
    from flyball.math import scalar

    for name in ("sin", "cos", "sqrt", "atan2"):
        own = getattr(scalar, name)
        other = counting(own)
        for holder in [m.__dict__ for n, m in list(sys.modules.items()) if n.startswith("flyball")]:
            if holder.get(name) is own:
                holder[name] = other


def objects(a: np.ndarray) -> np.ndarray:
    """The same array of counted numbers."""
    out = np.empty(a.shape, object)
    for k, x in np.ndenumerate(a):
        out[k] = Counted(x)
    return out


def scope() -> dict[str, Any]:
    """The formulas that the parts call, by name."""
    from flyball.engine import element_dispatch, kinematics, loads, motion, solve

    names = {}
    for module in (element_dispatch, kinematics, loads, motion, solve):
        names |= {k: v for k, v in vars(module).items() if callable(v)}
    return names


def operations(S: Any, W: Any, y: np.ndarray, nq: int, nv: int) -> dict[str, int]:
    """Floating-point operations of every part."""
    S, W = (
        T._replace(**{k: objects(a) for k, a in T._asdict().items() if getattr(a, "dtype", None) == np.float64})
        for T in (S, W)
    )
    y = objects(y)
    names = scope() | {"S": S, "W": W, "y": y, "q": y[:nq], "v": y[nq : nq + nv], "z": y[nq + nv :]}
    names["dy"] = objects(np.zeros(len(y)))
    out = {}
    for part, text in PARTS.items():
        before = Counted.done
        exec(text, names)
        out[part] = Counted.done - before
    return out


def times(S: Any, W: Any, y: np.ndarray, nq: int, nv: int) -> dict[str, float]:
    """Nanoseconds of every part, each in a compiled loop of its own."""
    out = {}
    args = (S, W, y, y[:nq].copy(), y[nq : nq + nv].copy(), y[nq + nv :].copy(), np.zeros(len(y)))
    for part in PARTS:
        loop = compiled_loop(part)
        batch = max(200, BATCH // len(S.tree.parent))
        found = []
        for _ in range(REPEATS):
            begin = time.process_time()
            loop(batch, *args)
            found.append(1e9 * (time.process_time() - begin) / batch)
        out[part] = float(np.median(found[1:]))
    return out


_loops: dict[str, Callable] = {}


def compiled_loop(part: str) -> Callable:
    """A part again and again, compiled as the kernels are."""
    if part not in _loops:
        from flyball.compiler.kernels import kernel
        from flyball.tables.table_definitions import System, Work

        names = scope() | {"System": System, "Work": Work}
        arrays = ", ".join(f"{x}: Float1" for x in ("y", "q", "v", "z", "dy"))
        name = "".join(x for x in part if x.isalnum())
        head = f"def loop_{name}(n: int, S: System, W: Work, {arrays}) -> None:"
        exec(f"{head}\n    for _ in range(n):\n        {PARTS[part]}\n", names)
        _loops[part] = kernel(names[f"loop_{name}"])
    return _loops[part]


def rate() -> float:
    """Operations a nanosecond of compiled scalar code at its best: independent products and sums."""
    import numba

    @numba.njit(error_model="numpy")
    def loop(n: int, a: float, b: float) -> float:
        p = q = r = s = t = u = v = w = a
        for _ in range(n):
            p = p * b + a
            q = q * b + a
            r = r * b + a
            s = s * b + a
            t = t * b + a
            u = u * b + a
            v = v * b + a
            w = w * b + a
        return p + q + r + s + t + u + v + w

    loop(10, 0.1, 0.9)
    begin = time.process_time()
    loop(10_000_000, 0.1, 0.9)
    return 16 * 10_000_000 / (1e9 * (time.process_time() - begin))


def mechanisms() -> dict[str, Any]:
    """Names and models."""
    from robots import delta, humanoid
    from trees import flyball_tree

    import flyball as fb
    from mechanisms import chain, flyball_planar, fourbars

    examples = Path(__file__).resolve().parents[1] / "examples"
    return {
        "four-bar": flyball_planar(fourbars(1)),
        "Bricard": fb.load(examples / "bricard.toml"),
        "chain of 100": flyball_planar(chain(100)),
        "delta robot": flyball_tree(delta()),
        "humanoid": flyball_tree(humanoid()),
    }


def main() -> None:
    from flyball.engine.entry_point import MOTION
    from flyball.engine.motion import STAGES
    from flyball.simulation.initial_state import find_initial_state

    per_ns = rate()
    print(f"compiled scalar code at its best: {per_ns:.1f} operations a nanosecond\n")
    found = []
    for name, model in mechanisms().items():
        for layer in ("absolute", "joint"):
            start = find_initial_state(model.snapshot(), 0.0, None, None, layer)
            c = start.assembly.compiled
            c.at(0.0, start.assembly.q, start.assembly.v, MOTION)
            S, W = c.values.system, c.work
            W.options.stabilization, W.options.position_tolerance, W.options.velocity_tolerance = STAGES, 1e-10, 1e-9
            nq, nv = c.structure.nq, c.structure.nv
            ns = times(S, W, start.y, nq, nv)
            bytes_ = sum(a.nbytes for T in (S, W) for a in T if hasattr(a, "nbytes")) + sum(a.nbytes for a in S.ldl)
            found.append((name, layer, start, ns, bytes_))
    with_counted_functions()
    gc.collect()
    print(f"{'':14s}{'layer':10s}" + "".join(f"{p:>16s}" for p in PARTS) + f"{'kB':>8s}{'floor':>8s}")
    for name, layer, start, ns, bytes_ in found:
        c = start.assembly.compiled
        flops = operations(c.values.system, c.work, start.y, c.structure.nq, c.structure.nv)
        cells = "".join(f"{flops[p]:8d} {ns[p]:7.0f}" for p in PARTS)
        print(f"{name:14s}{layer:10s}{cells}{bytes_ / 1e3:8.1f}{flops['all'] / per_ns:6.0f} ns")


if __name__ == "__main__":
    main()
