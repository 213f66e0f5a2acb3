"""Contact solvers on the same problems: residual against iterations and against time, as a figure; the pyramid's error.

    python benchmarks/solvers.py [--balls 1000]

Problems are those of `cone_problems.py`, the convex form, from no impulses. Prints residuals [m/s] with iterations and
CPU milliseconds, and how many nanoseconds an iteration takes for a contact; draws docs/images/contact_solvers.png and
docs/images/friction_pyramid.png. Each point is a solve of its own, cut at that many iterations, the best time of three.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import timing  # noqa: F401  isort: skip  (before numpy: it fixes the thread counts)

import matplotlib as mpl
import numpy as np
from cone_problems import chain, pile, stack

from flyball.numerics.complementarity.contact_operator import residuals
from flyball.numerics.complementarity.contact_problem import STORAGE_TOO_SMALL, FactorStorage, allocate_solver
from flyball.numerics.complementarity.friction_pyramid import pyramid_sliding_friction
from flyball.numerics.complementarity.solver_choice import FACTORISING_SOLVERS, SOLVERS, allocate_island_solver

mpl.use("Agg")
import matplotlib.pyplot as plt

IMAGES = Path(__file__).parents[1] / "docs" / "images"
CUTS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)
LIMIT = 0.6  # CPU seconds: what takes longer is not cut later
SHOWN = {
    "jacobi": "Jacobi",
    "gauss-seidel": "Gauss-Seidel",
    "barzilai-borwein": "Barzilai-Borwein",
    "apgd": "APGD as published",
    "apgd-lean": "APGD, lean",
    "newton": "primal Newton",
    "admm": "ADMM",
}


def points(name: str, P, v: np.ndarray, wide: np.ndarray) -> list[tuple[float, float, float, float]]:
    """Iterations, milliseconds, residual [m/s] and force residual of solves cut one after the other."""
    X, W, O, F = allocate_solver(P)
    out = []
    room = allocate_island_solver(P, True) if name in FACTORISING_SOLVERS else F
    F = FactorStorage(room.numbers, room.places)
    solver = SOLVERS[name]
    solver(P, X, W, O, F, 0)
    if O.count.ended == STORAGE_TOO_SMALL:
        F = FactorStorage(np.zeros(O.count.needed_numbers), np.zeros(O.count.needed_places, np.int64))
    for cut in CUTS:
        spent, used = np.inf, 0
        for _ in range(3):
            X.v[:], X.wide[:], X.p[:] = v, wide, 0.0
            O.count.most, O.real.enough = cut, 0.0
            began = time.process_time()
            used = solver(P, X, W, O, F, 0)
            spent = min(spent, time.process_time() - began)
        left = residuals(P, X, O, (X.v, X.wide, v, wide))
        out.append((used, 1e3 * spent, left[0], left[1]))
        if spent > LIMIT or left[0] < 1e-12 or used < cut:
            break
    return out


def table(title: str, contacts: int, found: dict) -> None:
    """What the figure shows, as text."""
    print(f"\n{title}: {contacts} contacts. residual [m/s] after iterations (ms)")
    for name, rows in found.items():
        each = ""
        if len(rows) > 2 and rows[-1][0] > rows[-3][0]:
            each = f"{1e6 * (rows[-1][1] - rows[-3][1]) / (rows[-1][0] - rows[-3][0]) / contacts:6.0f} ns"
        told = "  ".join(f"{r[2]:.0e} {r[0]:.0f} ({r[1]:.2g})" for r in rows[3::2])
        print(f"{SHOWN.get(name, name):18s}{each:>10s}  {told}")


def draw(scenes: dict) -> None:
    figure, axes = plt.subplots(2, len(scenes), figsize=(3.4 * len(scenes), 6), sharey="col", layout="constrained")
    for column, (title, (_, found)) in enumerate(scenes.items()):
        for row, (at, label) in enumerate(((0, "iterations"), (1, "CPU time [ms]"))):
            a = axes[row, column]
            for k, (name, rows) in enumerate(found.items()):
                x = np.array(rows)
                a.loglog(x[:, at], np.maximum(x[:, 2], 1e-13), f"C{k}.-", lw=1.2, ms=4, label=SHOWN.get(name, name))
            a.set_xlabel(label)
            a.grid(alpha=0.3)
        axes[0, column].set_title(title)
    for a in axes[:, 0]:
        a.set_ylabel("residual [m/s]")
    axes[0, 0].legend(fontsize=7)
    figure.savefig(IMAGES / "contact_solvers.png", dpi=80)


def draw_pyramid() -> None:
    angle = np.linspace(0, 2 * np.pi, 721)
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    for k, d in enumerate((3, 4, 8, 16)):
        share = np.array([pyramid_sliding_friction(d, a) for a in angle])
        half = np.pi / d
        stick = np.cos(half) / np.cos((angle % (2 * half)) - half)
        axes[0].plot(stick * np.cos(angle), stick * np.sin(angle), f"C{k}", label=f"d = {d}")
        axes[1].plot(np.degrees(angle), share[:, 0], f"C{k}")
        axes[1].plot(np.degrees(angle), share[:, 1], f"C{k}:")
    axes[0].plot(np.cos(angle), np.sin(angle), "k", lw=0.8, label="cone")
    axes[0].set(aspect="equal", title="what holds, over mu p_n", xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    axes[1].set(title="sliding: along, and across (dotted)", xlabel="direction [deg]", xlim=(0, 180))
    axes[1].axhline(1, color="k", lw=0.8)
    axes[0].legend(fontsize=7, loc="center")
    figure.savefig(IMAGES / "friction_pyramid.png", dpi=80)


def main() -> None:
    balls = int(sys.argv[sys.argv.index("--balls") + 1]) if "--balls" in sys.argv else 1000
    problems = {
        "stack of 10 cubes": stack([1000.0] * 10),
        "1000:1 on 10 cubes": stack([1.0] * 10 + [1000.0]),
        f"pile of {balls} balls": pile(balls),
        "chain of 20 rods, tip 100:1": chain(),
    }
    scenes = {}
    for title, (P, v, wide) in problems.items():
        found = {}
        for name in (n for n in SHOWN if n in SOLVERS):
            if len(P.mu) > 1000 and name in ("newton", "admm"):
                continue  # factors of piles fill up: see docs/contact_solvers.md
            points(name, *stack([1.0]))  # compiles
            found[name] = points(name, P, v, wide)
        scenes[title] = len(P.mu), found
        table(title, len(P.mu), found)
    draw(scenes)
    draw_pyramid()


if __name__ == "__main__":
    main()
