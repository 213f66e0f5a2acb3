"""The motion of a mechanism's copy that is moved, turned or reflected is its own motion, moved, turned or reflected."""

from dataclasses import replace

import numpy as np
import pytest

import flyball as fb
from flyball.model.element import resolve
from flyball.model.placement import Placement, rotation_of
from flyball.model.snapshot import hidden_parts
from tests.contract.test_everything import everything
from tests.contract.zoo import CASES, joined
from tests.model.test_shapes import SAMPLES
from tests.robust.families import made

AT, TURN = (0.7, -0.4, 1.1), (0.9, -0.5, 1.4)
PLACED = {
    "moved": {"at": AT},
    "turned": {"at": AT, "orientation": TURN},
    "mirrored x": {"mirror": "x"},
    "mirrored y": {"mirror": "y", "at": AT},
    "mirrored z": {"mirror": "z"},
    "mirrored and turned": {"mirror": "y", "at": AT, "orientation": TURN},
}


def placed(m: fb.Mechanism, how: dict) -> tuple[fb.Mechanism, Placement]:
    """A mechanism that has a copy of another as its only part, in gravity that is turned too."""
    turned = how.get("orientation")
    if m.planar:
        how = {k: x[:2] if k == "at" else 0.8 if k == "orientation" else x for k, x in how.items()}
        how = {"angle" if k == "orientation" else k: x for k, x in how.items()}
        R = rotation_of(None, 0.8 if turned else 0.0, "")
    else:
        R = rotation_of(turned or (0, 0, 0), 0.0, "")
    place = Placement((*how.get("at", (0, 0)), 0.0)[:3], R, how.get("mirror", ""))
    whole = fb.Mechanism(m.name, planar=m.planar, gravity=(place.polar @ m.gravity_vector())[: 2 if m.planar else 3])
    part = m.copy()
    part.gravity = whole.gravity
    whole.add(part, prefix="copy", **how)
    return whole, place


def assert_images(
    m: fb.Mechanism, whole: fb.Mechanism, place: Placement, t_end: float = 0.1, close: float = 1e-6, **options
) -> None:
    """Both motions have the same energies, and positions, velocities and accelerations that are images of each other."""
    rs = [x.simulate(t_end, outputs=np.linspace(0.0, t_end, 5), rtol=1e-10, atol=1e-12, **options) for x in (m, whole)]
    n = 2 if m.planar else 3
    hidden = hidden_parts(m)  # reference shafts stand anywhere
    for b in (b for b in m.bodies if b.name not in hidden):
        old, new = rs[0][b.name], rs[1][f"copy.{b.name}"]
        for what in ("position", "velocity", "acceleration"):
            x = np.array(getattr(old, what)) @ place.polar[:n, :n].T
            x = x + np.array(place.translation[:n]) if what == "position" else x
            size = 1.0 + np.abs(x).max()
            assert np.abs(np.array(getattr(new, what)) - x).max() < close * size, (b.name, what)
        w = np.array(old.angular_velocity)
        w = place.sign * w if m.planar else w @ place.axial.T
        assert np.abs(np.array(new.angular_velocity) - w).max() < close * (1.0 + np.abs(w).max()), b.name
    energies = [r.energy.total for r in rs]
    assert np.abs(energies[0] - energies[0][0] - energies[1] + energies[1][0]).max() < 1e-6 * (
        1 + np.abs(energies[0]).max()
    )


@pytest.mark.parametrize(("where", "name"), CASES)
def test_every_joint(where, name):
    """Joints in general position, on bodies in general position."""
    m = joined(where, name)
    for how in ("mirrored x", "mirrored and turned") if where == "plane" else ("mirrored z", "mirrored and turned"):
        # a profile's spline ends where its points do, which is at another angle of the image
        assert_images(m, *placed(m, PLACED[how]), close=1e-4 if name == "FlatFacedCam" else 1e-6)


@pytest.mark.parametrize("how", ["moved", "mirrored x", "mirrored y", "mirrored z"])
def test_every_force_and_coupling(how):
    """Sensors and springs along the world's axes too, which cannot be turned. Gears on unlike joints are left out."""
    m = everything().changed({"gears": None} | ({"tyre": None, "road": None} if how == "mirrored z" else {}))
    assert_images(m, *placed(m, PLACED[how]), 0.03)


@pytest.mark.parametrize("how", PLACED)
@pytest.mark.parametrize(
    ("family", "seed"), [("loops", 0), ("couplings", 1), ("ropes", 0), ("friction", 2), ("latches", 1), ("shaken", 0)]
)
def test_random_mechanisms(family, seed, how):
    m = made(family, seed).mechanism
    try:
        whole, place = placed(m, PLACED[how])
    except fb.ModelError as error:
        assert "cannot be" in str(error) or (m.planar and how == "mirrored z")
        return
    assert_images(m, whole, place, 0.05)


BOX = fb.Box(edges=(0.3, 0.05, 0.05), density=1000, position=(0.15, 0, 0))
LATER = {  # elements with parts of their own, or whose texts name coordinates
    "force": lambda: fb.LinearActuator("C", "ground", "b", at=((0.2, 1), (1.5, 0.2)), force="30 - 5*rate"),
    "length": lambda: fb.LinearActuator(
        "C", "ground", "b", at=((0.2, 1), (1.5, 0.2)), length="1.526433752247179 - 0.2*t**2"
    ),
    "masses": lambda: fb.LinearActuator("C", "ground", "b", at=((0.2, 1), (1.5, 0.2)), force="30", barrel=BOX, rod=BOX),
    "constraint": lambda: fb.Constraint("K", "A.angle - 2*B.angle + 0.3*B.angle**2 - 0.4*t**2"),
    "speed": lambda: fb.Motor("M", "A", speed="3*t", limit="50"),
    "saturated": lambda: fb.Motor("M", "A", speed="5", limit="10"),
    "rate": lambda: fb.Driver("D", "A.angle_rate", "2*t"),
    "winch": lambda: fb.Rope("R", ["ground", "b"], at=((0.2, 1), (1.5, 0.2)), drum="A.angle", radius=0.1),
    "elastic winch": lambda: fb.Rope(
        "R", ["ground", "b"], at=((0.2, 1), (1.5, 0.2)), drum="A.angle", radius=0.1, stiffness=100
    ),
    "feed": lambda: fb.Rope("R", ["ground", "b"], at=((0.2, 1), (1.5, 0.2)), feed="-0.1*t**2"),
    "pulley": lambda: fb.Rope("R", ["ground", "b"], at=((0.2, 1), (1.5, 0.2)), radii=(0.1, 0), turns=(2, 0)),
}


@pytest.mark.parametrize("how", ["turned", "mirrored x", "mirrored y", "mirrored and turned"])
@pytest.mark.parametrize("name", LATER)
def test_elements_made_of_parts(name, how):
    m = fb.Mechanism("double pendulum", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1, inertia=0.1, position=(1.5, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)), LATER[name]())
    assert_images(m, *placed(m, PLACED[how]))


def in_contact() -> fb.Mechanism:
    """Solids without symmetry on a floor of unequal friction that moves like a belt, and a set of bodies."""
    m = fb.Mechanism("scene", gravity=(0, 0, -9.81))
    m.add(fb.Material("wood", friction=(0.5, 0.1), grain=(1, 0.3, 0), surface_velocity=(0.1, 0.2, 0)))
    m.add(fb.Material("stone", friction=0.4, restitution=0.2))
    box = fb.Box(edges=(1, 1, 0.1), position=(2, 0.5, 0.1))
    m.add(fb.Ground("floor", shape=(fb.Plane(normal=(0.1, 0.2, 1)), box), material="wood"))
    hull = fb.Hull(vertices=[(0, 0, 0), (0.3, 0, 0), (0, 0.2, 0), (0.05, 0.05, 0.25)])
    for k, shape in enumerate((
        fb.Cone(radius=0.1, height=0.3, orientation=(0.3, 0.4, 0)), hull,
        fb.Prism(outline=[(0, 0), (0.3, 0), (0.1, 0.2)], thickness=0.05),
    )):  # fmt: skip
        turning = {"orientation": (0.2, 0.5, 0.1), "angular_velocity": (3, -2, 1), "velocity": (1, 0.5, 0)}
        m.add(fb.Body(f"b{k}", density=500, shape=shape, position=(k - 1, 0, 0.5), material="stone", **turning))
    m.add(
        fb.Bodies(
            "balls", shape=fb.Hemisphere(radius=0.1), density=1000, position=[(0, 1, 0.6), (0.5, 1, 0.7)],
            orientation=(0.9, 0.1, 0.2, 0.3), angular_velocity=(1, 2, 0), velocity=(0.3, 0, 0), material="stone",
        ),
        fb.Contact("touch"),
    )  # fmt: skip
    return m


@pytest.mark.parametrize("how", PLACED)
def test_bodies_in_contact(how):
    m = in_contact()
    whole, place = placed(m, PLACED[how])
    runs = [x.simulate(0.4, method="impulse", outputs=5) for x in (m, whole)]
    assert all(runs[0][f"b{k}"].velocity[-1, 2] > -0.9 * 9.81 * 0.4 for k in range(3))  # none falls freely
    for name in ("b0", "b1", "b2", "balls"):
        wanted = np.array(runs[0][name].position) @ place.polar.T + np.array(place.translation)
        assert np.abs(runs[1][f"copy.{name}"].position - wanted).max() < 1e-9, name


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("shape", SAMPLES, ids=lambda s: type(s).__name__)
def test_every_shape(shape, axis):
    """The mirror image of a solid, turned on its body, has the mirror images of its surface, centre and inertia."""
    if not hasattr(shape, "start"):
        shape = replace(shape, position=(0.3, -0.1, 0.2), orientation=(0.4, -0.7, 1.1))
    image, S = shape.mirrored(axis), Placement(mirror=axis).reflection
    old, new = (resolve(x, {}) for x in (shape, image))
    (c, J), (d, K) = shape.placed(old), image.placed(new)
    assert np.abs(S @ c - d).max() < 1e-12
    assert np.abs(S @ J @ S - K).max() < 1e-12 * np.abs(J).max()
    v, w = shape.mesh(old)[0] @ S, image.mesh(new)[0]
    for d in np.random.default_rng(3).normal(size=(20, 3)):  # both extend as far, but for the facets of round sides
        assert (v @ d).max() == pytest.approx((w @ d).max(), abs=0.02 * np.linalg.norm(d) * np.ptp(v))
