"""Convex shapes of a user's own, by their support functions: against every shape, and in motion."""

from __future__ import annotations

from math import pi
from typing import Annotated, ClassVar

import numpy as np
import pytest

import flyball as fb
from flyball.collision.contact_finder import ContactFinder
from flyball.elements import ConvexSolid, Length, Number, Point, Unit, element
from flyball.math.scalar import sqrt
from flyball.math.vec import dot, scale
from flyball.tables.contact_tables import contact_tables
from flyball.tables.element_numbers import element_numbers
from flyball.testing import CHECKS, ContractError, check_element


def of_ellipsoid(par, d):
    """Where the normal is d: A d / |A^(1/2) d|, A the squares of the half axes."""
    x, y, z = par[0] * d[0], par[1] * d[1], par[2] * d[2]
    s = 1.0 / sqrt(x * x + y * y + z * z)
    return (s * par[0] * x, s * par[1] * y, s * par[2] * z)


@element
class Pebble(ConvexSolid):
    """An ellipsoid."""

    semi_axes: Point

    support: ClassVar = staticmethod(of_ellipsoid)

    def parameters(self, n):
        """The half axes."""
        return n.semi_axes

    def volume(self, n):
        """V = 4/3 pi a b c."""
        a, b, c = n.semi_axes
        return 4 / 3 * pi * a * b * c

    def gyration(self, n):
        """(b^2 + c^2) / 5 and so on."""
        a, b, c = n.semi_axes
        return (b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5


@element
class Lentil(ConvexSolid):
    """What two balls have in common whose centres are at (0, 0, offset) and (0, 0, -offset)."""

    radius: Length = 1.0
    offset: Length = 0.5

    @staticmethod
    def support(par, d):
        """A point of one of the two balls, or of the rim."""
        r, c = par[0], par[1]
        length = sqrt(dot(d, d))
        up = 1.0 if d[2] > 0.0 else -1.0
        if r * up * d[2] >= c * length:
            x = scale(r / length, d)
            return (x[0], x[1], x[2] - up * c)
        rim = sqrt((r * r - c * c) / (d[0] * d[0] + d[1] * d[1]))
        return (rim * d[0], rim * d[1], 0.0)

    def parameters(self, n):
        """Radius of the balls and half the distance of their centres."""
        return n.radius, n.offset


@element
class SuperEllipsoid(ConvexSolid):
    """|x/a|^p + |y/b|^p + |z/c|^p <= 1, p > 1."""

    semi_axes: Point
    exponent: Annotated[Number, Unit("1")] = 2.0

    @staticmethod
    def support(par, d):
        """x = a (a d_x / h)^(1/(p - 1)), ..., h^q = sum of (a d_x)^q, q = p/(p - 1)."""
        power = 1.0 / (par[3] - 1.0)
        u, v, w = abs(par[0] * d[0]), abs(par[1] * d[1]), abs(par[2] * d[2])
        most = max(u, v, w)
        u, v, w = (u / most) ** power, (v / most) ** power, (w / most) ** power
        h = (u ** par[3] + v ** par[3] + w ** par[3]) ** (1.0 / par[3])
        x, y, z = par[0] * u / h, par[1] * v / h, par[2] * w / h
        return (x if d[0] > 0.0 else -x, y if d[1] > 0.0 else -y, z if d[2] > 0.0 else -z)

    def parameters(self, n):
        """Half axes and exponent."""
        return (*n.semi_axes, n.exponent)


HALF = (0.5, 0.3, 0.4)
CUBE = [(x, y, z) for x in (-0.4, 0.4) for y in (-0.3, 0.3) for z in (-0.5, 0.5)]
OTHERS = {
    "plane": fb.Plane(),
    "box": fb.Box(edges=(1, 0.8, 0.6)),
    "sphere": fb.Sphere(radius=0.5),
    "capsule": fb.Capsule(radius=0.3, length=0.6),
    "cylinder": fb.Cylinder(radius=0.4, length=0.8),
    "cone": fb.Cone(radius=0.5, height=0.8),
    "ellipsoid": fb.Ellipsoid(semi_axes=(0.6, 0.4, 0.5)),
    "hemisphere": fb.Hemisphere(radius=0.6),
    "hull": fb.Hull(vertices=CUBE),
    "field": fb.HeightField(heights=((0, 0.1, 0), (0.2, 0, 0.1), (0, 0.3, 0.1)), dx=0.8),
    "lens": Lentil(radius=0.6, offset=0.2),
}


def contacts(shape, other, rng):
    """Contacts of a shape at random poses with another that stands still."""
    out = []
    for _ in range(12):
        q = rng.normal(size=4)
        way = rng.normal(size=3)
        m = fb.Mechanism("pair")
        place = np.array([0.0, 0.0, 0.3]) + rng.uniform(0.3, 0.8) * way / np.linalg.norm(way)
        m.add(
            fb.Body(
                "b",
                shape=shape,
                mass=1,
                inertia=(1, 1, 1),
                position=tuple(place),
                orientation=tuple(q / np.linalg.norm(q)),
            )
        )
        m.add(fb.Ground("other", shape=other), fb.Contact(friction=0.3))
        model = m.snapshot()
        scene = contact_tables(model, element_numbers(model), ["b"])
        found = ContactFinder(scene.geometry, margin=0.1).find(scene.carriers.movers)
        out.append(found.x[: found.count.found, :7])
    return out


@pytest.mark.parametrize("other", OTHERS)
def test_an_ellipsoid_of_ones_own_touches_as_the_built_in_one(other):
    found = contacts(Pebble(semi_axes=HALF), OTHERS[other], np.random.default_rng(3))
    known = contacts(fb.Ellipsoid(semi_axes=HALF), OTHERS[other], np.random.default_rng(3))
    assert sum(map(len, known)) >= 4
    for a, b in zip(found, known, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_a_lens_rocks():
    """Its lower side has the radius R about a point c above its centre: w^2 = m g c / (I + m (R - c)^2)."""
    R, c, mass, I, lean = 1.0, 0.5, 2.0, 0.3, 0.05
    m = fb.Mechanism("rocking", gravity=(0, 0, -9.81))
    turned = (np.cos(lean / 2), 0, np.sin(lean / 2), 0)
    lens = fb.Body("lens", shape=Lentil(radius=R, offset=c), mass=mass, inertia=(I, I, 0.5), orientation=turned,
                   position=(0, 0, R - c * np.cos(lean)))  # fmt: skip
    m.add(lens, fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.8))
    r = m.simulate(3.0, outputs=301)
    lean = 2.0 * r["lens"].quaternion[:, 2]
    k = np.flatnonzero(np.diff(np.sign(lean)))
    zeros = r.t[k] - lean[k] * (r.t[k + 1] - r.t[k]) / (lean[k + 1] - lean[k])
    w = np.sqrt(mass * 9.81 * c / (I + mass * (R - c) ** 2))
    np.testing.assert_allclose(pi / np.diff(zeros), w, rtol=2e-3)
    assert r.energy.drift < 1e-9


def test_a_super_ellipsoid_falls_and_lies_on_another():
    """Two of them, one on the other: each as high as its half axis; the floor carries both weights."""
    m = fb.Mechanism("pile", gravity=(0, 0, -10))
    for k, height in enumerate((0.25, 0.75)):
        shape = SuperEllipsoid(semi_axes=(0.5, 0.4, 0.2), exponent=3)
        m.add(fb.Body(f"b{k}", shape=shape, mass=1, inertia=(0.1, 0.1, 0.1), position=(0, 0, height)))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.5))
    r = m.simulate(2.0, outputs=21)
    assert r["b0.z"][-1] == pytest.approx(0.2, abs=1e-4)
    assert r["b1.z"][-1] == pytest.approx(0.6, abs=1e-4)


def test_many_sizes():
    """A shape that is enlarged is so in every direction, whatever its parameters are."""
    m = fb.Mechanism("many", gravity=(0, 0, -10))
    shape = SuperEllipsoid(semi_axes=(0.5, 0.4, 0.2), exponent=4)
    m.add(
        fb.Bodies(
            "b",
            shape=shape,
            mass=1,
            inertia=(0.1, 0.1, 0.1),
            scale=(1.0, 2.0),
            position=((0, 0, 0.2), (5, 0, 0.4)),
        )
    )
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.5))
    model = m.snapshot()
    scene = contact_tables(model, element_numbers(model), ["b"])
    found = ContactFinder(scene.geometry, margin=0.1).find(scene.carriers.movers)
    np.testing.assert_allclose(found.x[:2, 6], 0.0, atol=1e-12)


def test_mass_pictures_and_files(tmp_path):
    m = fb.Mechanism("stone", gravity=(0, 0, -10))
    m.add(
        fb.Body("a", shape=Pebble(semi_axes=HALF), density=1000),
        fb.Body("b", shape=fb.Ellipsoid(semi_axes=HALF), density=1000),
    )
    report = m.mass_properties(drawn=True)
    assert report["a"].mass == report["b"].mass
    np.testing.assert_allclose(report["a"].inertia, report["b"].inertia)
    m.save(tmp_path / "stone.toml")
    assert fb.load(tmp_path / "stone.toml") == m


def own(formula=None, **more):
    """A class of shapes with this support function."""
    support = {} if formula is None else {"support": staticmethod(formula)}
    return element(type("Own", (ConvexSolid,), {"__module__": __name__, "__annotations__": {}, **support, **more}))


WRONG = {
    "no formula": (own, r"Own has no formula support\(par, d\)"),
    "not static": (lambda: own(support=lambda par, d: d), "Own.support must be a static method"),
    "arguments": (lambda: own(lambda d: d), "Own.support takes d; it must take par, d"),
    "nan": (lambda: own(lambda par, d: (d[0] / d[0], d[1], d[2])), r"Own.support gives .* for the direction \(.*0.0"),
    "not a point": (lambda: own(lambda par, d: d[0]), "Own.support gives .* must give a point, a tuple of three"),
    "compiled": (
        lambda: own(lambda par, d: (d[0], d[1], float(str(d[2])))),
        "Own.support cannot be compiled for floats",
    ),
    "parameters": (
        lambda: own(of_ellipsoid, parameters=lambda self, n: (1.0,) * 8),
        "gives 8 numbers; a shape has up to 7",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_by_name(case):
    make, message = WRONG[case]
    m = fb.Mechanism("m", gravity=(0, 0, -10))
    m.add(fb.Body("b", shape=make()(), mass=1, inertia=(1, 1, 1), position=(0, 0, 2)))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact(friction=0.5))
    with pytest.raises(fb.ModelError, match=message):
        m.simulate(0.1)


def test_without_a_volume_the_mass_has_to_be_given():
    m = fb.Mechanism("m")
    with pytest.raises(fb.ModelError, match="Lentil defines no volume and gyration, so it has no mass; give mass= and"):
        m.add(fb.Body("b", shape=Lentil(), density=1000))


def test_a_type_that_two_modules_define_is_no_type_of_a_file(tmp_path):
    for module in ("one", "two"):
        element(type("Cobble", (Pebble,), {"__module__": module, "__annotations__": {}}))
    m = fb.Mechanism("m", gravity=(0, 0, -10))
    m.add(fb.Body("b", shape=Pebble.registry["Cobble"](semi_axes=HALF), mass=1, inertia=(1, 1, 1)))
    m.save(tmp_path / "cobble.toml")
    with pytest.raises(
        fb.ModelError, match=r"'b'.*type 'Cobble' is defined by several modules, one, two; a file identifies"
    ):
        fb.load(tmp_path / "cobble.toml")


RIGHT = [Pebble(semi_axes=HALF), Lentil(radius=0.6, offset=0.2), SuperEllipsoid(semi_axes=HALF, exponent=3)]


@pytest.mark.parametrize("e", RIGHT, ids=lambda e: type(e).__name__)
def test_right_shapes_keep_the_contract(e):
    assert check_element(e) == list(CHECKS["shapes"])


BROKEN = {
    "numbers": {"support": staticmethod(lambda par, d: (0.0 * par[0] + float("nan"), d[1], d[2]))},
    "support": {"support": staticmethod(lambda par, d: (par[0] * d[0], par[1] * d[1], par[2] * d[2]))},
    "mass": {"gyration": lambda self, n: (0.1, 0.1, 0.1)},
}


@pytest.mark.parametrize("part", BROKEN)
def test_a_wrong_shape_is_caught_by_the_part_that_it_breaks(part):
    kind = element(type("Own", (Pebble,), {"__module__": __name__, "__annotations__": {}, **BROKEN[part]}))
    with pytest.raises(ContractError, match=rf"Own fails the check '{part}': "):
        check_element(kind(semi_axes=HALF))
