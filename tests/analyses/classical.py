"""Mechanisms whose stability limits are published or have a closed form."""

from __future__ import annotations

import numpy as np

import flyball as fb

G = 9.81


def bicycle(speed: float = 5.0) -> fb.Mechanism:
    """The benchmark bicycle of Meijaard, Papadopoulos, Ruina and Schwab (2007, Proc. R. Soc. A 463), rolling straight.

    Its axes are x forward and z down; here z points up.
    """
    wheelbase, trail, tilt = 1.02, 0.08, np.pi / 10
    m = fb.Mechanism("bicycle", gravity=(0, 0, -G), parameters={"v": speed})
    for name, mass, at, inertia in (
        ("rear frame", 85, (0.3, 0, 0.9), ((9.2, 0, -2.4), (0, 11, 0), (-2.4, 0, 2.8))),
        ("front frame", 4, (0.9, 0, 0.7), ((0.05892, 0, 0.00756), (0, 0.06, 0), (0.00756, 0, 0.00708))),
    ):
        m.add(fb.Body(name, mass=mass, inertia=inertia, position=at, velocity=("v", 0, 0)))
    for end, x, radius, mass, inertia in (
        ("rear", 0, 0.3, 2, (0.0603, 0.12, 0.0603)),
        ("front", wheelbase, 0.35, 3, (0.1405, 0.28, 0.1405)),
    ):
        moving = {"velocity": ("v", 0, 0), "angular_velocity": (0, f"v/{radius}", 0)}
        m.add(fb.Body(f"{end} wheel", mass=mass, inertia=inertia, position=(x, 0, radius), **moving))
        m.add(fb.Revolute(f"{end} hub", f"{end} frame", f"{end} wheel", at=(x, 0, radius), axis=(0, 1, 0)))
        contact = {"at": (x, 0, radius), "axis": (0, 1, 0), "radius": radius}
        m.add(fb.RollingDisk(f"{end} contact", "ground", f"{end} wheel", **contact))
    axis = (-np.sin(tilt), 0, np.cos(tilt))
    m.add(fb.Revolute("head", "rear frame", "front frame", at=(wheelbase + trail, 0, 0), axis=axis))
    return m


WEAVE, CAPSIZE = 4.29238253634111, 6.02426201538837  # speeds [m/s] at which these become stable and unstable
AT_FIVE = (-14.07838969279822, -0.32286642900409, -0.77534188219585 + 4.46486771378823j)  # eigenvalues at 5 m/s


def disk(speed: float = 1.0, radius: float = 0.5) -> fb.Mechanism:
    """A thin uniform disk that rolls upright: stable from v^2 = g r / 3 on (Routh 1905)."""
    m = fb.Mechanism("disk", gravity=(0, 0, -G), parameters={"v": speed})
    I = radius**2 / 4
    moving = {"velocity": ("v", 0, 0), "angular_velocity": (0, f"v/{radius}", 0)}
    at = (0, 0, radius)
    m.add(fb.Body("disk", mass=1, inertia=(I, 2 * I, I), position=at, **moving))
    m.add(fb.RollingDisk("road", "ground", "disk", at=at, axis=(0, 1, 0), radius=radius))
    return m


def stand(damping: float) -> fb.Mechanism:
    """A uniform rod of 1 m and 1 kg upright on a cart, held by a spring k: it stands from k = m g l / 2 on."""
    m = fb.Mechanism("stand", planar=True, gravity=(0, -G), parameters={"k": 1.0})
    m.add(fb.Body("cart", mass=2, inertia=1), fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "pin.angle", stiffness="k", damping=damping))
    return m


def column(links: int, follows: bool, damping: float = 0.0, columns: int = 1) -> fb.Mechanism:
    """Links of 1 m with springs of 1 N m / rad and masses of 1 kg at their ends (the first of two: 2 kg), pressed by P.

    The load follows the last link (Ziegler 1952), or keeps its direction.
    """
    m = fb.Mechanism("column", planar=True, parameters={"P": 0.1, "c": damping})
    for x in range(columns):
        before = "ground"
        for k in range(links):
            name = f"link {k} of {x}"
            mass = 2.0 if links == 2 and k == 0 else 1.0
            m.add(fb.Body(name, mass=mass, inertia=0, position=(x, k + 1)))
            m.add(fb.Revolute(f"hinge {k} of {x}", before, name, at=(x, k)))
            m.add(fb.TorsionalSpringDamper(f"spring {k} of {x}", joint=f"hinge {k} of {x}", stiffness=1, damping="c"))
            before = name
        axes = "body" if follows else "world"
        m.add(fb.PointForce(f"load {x}", before, at=(x, links), axes=axes, force=("0", "-P")))
    return m


def foucault(speed: float = 1.0) -> fb.Mechanism:
    """A pendulum of 1 m that hangs by a cross from the middle of a driven table."""
    m = fb.Mechanism("Foucault", gravity=(0, 0, -G))
    m.add(fb.Body("table", mass=1, inertia=(1, 1, 1)))
    m.add(fb.Body("bob", mass=1, inertia=(1e-6,) * 3, position=(0, 0, -1)))
    m.add(fb.Revolute("shaft", "ground", "table", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Driver("drive", "shaft.angle", f"{speed}*t"))
    m.add(fb.Universal("hook", "table", "bob", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))))
    return m
