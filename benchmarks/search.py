"""Time of a search for contacts, by number of spheres: `python benchmarks/search.py [N ...]`.

Spheres (radius 0.1 m) are poured into a box of planes by pushing them apart, then move about at some mm/s, 5 ms a step.
CPU time of one thread, the least of ten runs of ten steps; beside it that of a search for all pairs.
"""

import sys
import time

import numpy as np

from flyball.collision.contact_finder import ContactFinder, no_movers
from flyball.collision.contact_search import REBUILD, STEP
from flyball.collision.shape_kinds import PLANE, SPHERE
from flyball.collision.tables import (  # fmt: skip
    ContactTable,
    Dimensions,
    Geometry,
    Movers,
    Search,
    Shapes,
)
from flyball.compiler.formulas import call, formula
from flyball.compiler.kernels import kernel

R, H, MARGIN = 0.1, 5e-3, 2e-3


@formula
def go(address, G, M, C, O, B, h, steps, task):
    """Move on and search, again and again; an even number of steps leaves C and O as they were."""
    for k in range(steps):
        for m in range(M.pose.shape[0]):
            for c in range(3):
                M.pose[m, c] += h * M.twist[m, c]
        status = call(address, G, M, C, O, B, task) if k % 2 == 0 else call(address, G, M, O, C, B, task)
        if status != 0:
            return status
    return 0


@kernel
def go_kernel(
    address: int, G: Geometry, M: Movers, C: ContactTable, O: ContactTable, B: Search, h: float, steps: int, task: int
) -> int:
    return go(address, G, M, C, O, B, h, steps, task)


def box_of_spheres(n):
    """Spheres on a grid in a box as high as they need: shapes, movers."""
    side = round(n ** (1 / 3))
    pitch = 2.02 * R
    half = 0.5 * pitch * side + 0.01
    k = np.arange(n)
    x = np.stack([k % side, k // side % side, k // side**2], 1) * pitch + [R + 0.01 - half, R + 0.01 - half, R + 0.01]
    x += np.random.default_rng(0).uniform(-0.1, 0.1, (n, 3)) * R
    planes = [((0, 0, 0), (0, 0, 1))]
    planes += [((s * half * (1 - c), s * half * c, 0), (-s * (1 - c), -s * c, 0)) for s in (1, -1) for c in (0, 1)]
    shape, dimensions = Shapes.blank(n + 5), Dimensions.blank(n + 5)
    shape.member[:], shape.mask[:], shape.kind[:n], shape.mover[:n] = 1, -1, SPHERE, k
    shape.kind[n:], shape.mover[n:] = PLANE, -1
    dimensions.axes[:, [0, 4, 8]] = 1.0
    dimensions.par[:n, 0] = dimensions.radius[:n] = R
    dimensions.radius[n:] = np.inf
    for i, (p, z) in enumerate(planes, start=n):
        x_axis = np.cross(z, [0.3, 0.5, 0.7])
        x_axis /= np.linalg.norm(x_axis)
        dimensions.place[i], dimensions.axes[i] = p, np.stack([x_axis, np.cross(z, x_axis), z], 1).ravel()
    M = no_movers(n)
    M.pose[:, :3] = x
    return Geometry(shape, dimensions, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64)), M


def pour(F, G, M, rounds):
    """Let all sink a little and push apart what overlaps."""
    mover = G.shape.mover[:]
    for k in range(rounds):
        M.pose[:, 2] -= 0.02 * R * (1.0 - k / rounds)
        for _ in range(3):
            C = F.find(M)
            n = C.count.found
            a, b = mover[C.at[:n, 0]], mover[C.at[:n, 1]]
            push = 0.5 * np.minimum(C.x.gap[:n], 0.0)[:, None] * C.x.normal[:n]
            push *= np.where((a < 0) | (b < 0), 2.0, 1.0)[:, None]
            for c in range(3):
                M.pose[:, c] += np.bincount(a[a >= 0], push[a >= 0, c], len(M.pose))
                M.pose[:, c] -= np.bincount(b[b >= 0], push[b >= 0, c], len(M.pose))


def timed(F, M, task, runs=10, steps=10):
    """Least CPU time of a step [ms]."""
    least = np.inf
    for _ in range(runs):
        M.twist[:, :3] *= -1.0
        while True:
            start = time.process_time()
            status = go_kernel(F.address, F.geometry, M, F.now, F.before, F.search, H, steps, task)
            took = time.process_time() - start
            if status == 0:
                break
            F.enlarge(status, F.now.count)
        least = min(least, took / steps)
    return 1e3 * least


def main():
    print("spheres  pairs  contacts  step ms  all pairs ms  made anew a step")
    for n in map(int, sys.argv[1:] or ["1000", "4000", "16000"]):
        G, M = box_of_spheres(n)
        F = ContactFinder(G, margin=MARGIN, ahead=H)
        pour(F, G, M, 40)
        M.twist[:, :3] = 5e-3 * np.random.default_rng(1).standard_normal((n, 3))
        F.find(M)
        everything = timed(F, M, REBUILD, runs=3, steps=4)
        made, afresh = F.search.count.envelopes_renewed, F.search.count.rebuilds
        step = timed(F, M, STEP)
        made, afresh = F.search.count.envelopes_renewed - made, F.search.count.rebuilds - afresh
        print(
            f"{n:7d} {F.now.count.pairs:6d} {F.now.count.found:9d} {step:8.3f} {everything:13.3f} "
            f"{made / 100:8.1f} ({afresh} times all)"
        )


if __name__ == "__main__":
    main()
