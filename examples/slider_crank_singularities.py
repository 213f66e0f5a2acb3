"""All singular positions of the slider-crank, driven at the crank or at the slider, as a table and as pictures.

Cases after H. Hahn, Rigid Body Dynamics of Mechanisms 1 (2002), section 3.1.3: crank i and rod j have the lengths li,
lj and the angles psi_i, psi_j from the line of the slider. Everything in the table is found by ``m.singularities``.

Run it with ``python examples/slider_crank_singularities.py``; with ``pictures.png`` behind it, it draws them too.
"""

import sys

import numpy as np

import flyball as fb

LONG, SHORT, E = 0.5, 0.3, 0.4
PI = np.pi
T = np.arcsin(SHORT / LONG)  # of the longer crank, where the rod stands upright
CRANK = {  # case: (li, lj, psi_i, psi_j)
    "1.2a": (LONG, SHORT, T, -PI / 2),
    "1.2b": (LONG, SHORT, -T, PI / 2),
    "1.2c": (LONG, SHORT, PI - T, -PI / 2),
    "1.2d": (LONG, SHORT, PI + T, PI / 2),
    "1.3a": (SHORT, SHORT, PI / 2, -PI / 2),
    "1.3b": (SHORT, SHORT, -PI / 2, PI / 2),
}
SLIDER = {
    "2.1a": (SHORT, LONG, 0, 0),
    "2.1b": (SHORT, LONG, PI, 0),
    "2.2a": (LONG, SHORT, 0, 0),
    "2.2b": (LONG, SHORT, 0, PI),
    "2.3a": (SHORT, SHORT, 0, 0),
    "2.3b": (SHORT, SHORT, PI / 2, 3 * PI / 2),
    "2.3c": (SHORT, SHORT, 3 * PI / 2, PI / 2),
    "2.3d": (SHORT, SHORT, PI, PI),
    "2.3e": (SHORT, SHORT, PI / 2 + E, 3 * PI / 2 + E),
    "2.3f": (SHORT, SHORT, PI / 2 - E, 3 * PI / 2 - E),
    "2.3g": (SHORT, SHORT, PI, 2 * PI),
    "2.3h": (SHORT, SHORT, 3 * PI / 2 - E, PI / 2 - E),
    "2.3i": (SHORT, SHORT, 3 * PI / 2 + E, PI / 2 + E),
    "2.3j": (SHORT, SHORT, 0, PI),
}


def mechanism(
    li: float = SHORT, lj: float = LONG, psi_i: float = 0.4, psi_j: float | None = None, driven: str = "crank.angle"
) -> fb.Mechanism:
    """A slider-crank drawn at these angles [rad], its driver at rest there; by default one that turns."""
    moves = psi_j is None
    psi_j = -np.arcsin(li / lj * np.sin(psi_i)) if psi_j is None else psi_j
    B = li * np.array([np.cos(psi_i), np.sin(psi_i)])
    x = float(B[0] + lj * np.cos(psi_j))
    m = fb.Mechanism("slider-crank", planar=True, gravity=(0, 0))
    m.add(fb.Body("crank", mass=1, inertia=li**2 / 12, position=B / 2, angle=psi_i))
    m.add(fb.Body("rod", mass=1, inertia=lj**2 / 12, position=(B + np.array([x, 0])) / 2, angle=psi_j))
    m.add(fb.Body("slider", mass=1, inertia=1e-3, position=(x, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=B))
    m.add(fb.Revolute("C", "rod", "slider", at=(x, 0)))
    m.add(fb.Translational("D", "ground", "slider", at=(x, 0), axis=(1, 0)))
    start = psi_i if driven == "crank.angle" else x
    m.add(fb.Driver("drive", driven, f"{start!r} + t" if moves else start))
    return m


def case(li: float, lj: float, psi_i: float, psi_j: float, driven: str):
    """The singular position that the mechanism is drawn in."""
    m = mechanism(li, lj, psi_i, psi_j, driven)
    a = psi_i if driven == "crank.angle" else li * np.cos(psi_i) + lj * np.cos(psi_j)
    found = m.singularities("drive", (a - 0.1, a + 0.1))
    return next(p for p in found if abs(p.at) < 1e-9)


def cases() -> dict:
    """Case -> (driven coordinate, its position as found)."""
    out = {name: ("crank.angle", case(*x, "crank.angle")) for name, x in CRANK.items()}
    return out | {name: ("slider.x", case(*x, "slider.x")) for name, x in SLIDER.items()}


def told(p, rate: float = 0.0, acceleration: float = 0.0) -> str:
    """The motions of one drive: their rates, or from rest their accelerations, of crank and rod."""
    if not (n := p.count(rate=rate, acceleration=acceleration)):
        return "lock-up"
    texts = []
    for m in p.motions:
        if m.rate == rate and m.acceleration == acceleration:
            moves = max(map(abs, m.velocities.values())) > 1e-9
            numbers, dots = (m.velocities, "'") if moves else (m.accelerations, "''")
            texts.append(f"i{dots} {numbers['crank.angle']:+.4f} j{dots} {numbers['rod.angle']:+.4f}")
    return f"{n:g}: " + "; ".join(texts)


def table(found: dict) -> str:
    """One line a case."""
    rows = [("case", "psi_i", "psi_j", "what it is", "a' = 1", "a' = 0, a'' = 1", "a' = 0, a'' = -1")]
    rows.append(("1.1", "any", "", "none: the crank turns", "", "", ""))
    for name, (_, p) in found.items():
        angles = (f"{np.degrees(p.coordinates[k]) % 360:.4g}" for k in ("crank.angle", "rod.angle"))
        what = p.kind + (" (and self-motion)" if p.self_motion and p.kind != "self-motion" else "")
        rows.append((name, *angles, what, told(p, 1.0), told(p, 0.0, 1.0), told(p, 0.0, -1.0)))
    width = [max(len(r[k]) for r in rows) for k in range(len(rows[0]))]
    return "\n".join("  ".join(x.ljust(w) for x, w in zip(r, width, strict=True)).rstrip() for r in rows)


def pictures(found: dict, path: str) -> None:
    """The mechanism in every case."""
    import matplotlib.pyplot as plt

    from flyball.view.singularity_plots import plot_sketch

    figure, axes = plt.subplots(4, 5, figsize=(11, 8), layout="constrained")
    for ax, (name, (driven, p)) in zip(axes.flat, found.items(), strict=False):
        plot_sketch(ax, p)
        ax.set_title(f"{name}, {driven}\n{p.kind}", fontsize=9)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    all_cases = cases()
    print(table(all_cases))
    if len(sys.argv) > 1:
        pictures(all_cases, sys.argv[1])
