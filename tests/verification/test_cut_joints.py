"""Reactions are what they say: put in the place of the joints as given forces, they move the bodies as the joints did.

And a joint drawn the other way round, its two bodies exchanged, is the same joint with the reverse reactions.
"""

import dataclasses

import numpy as np
import pytest

import flyball as fb
from tests.layers import both_layers
from tests.mechanisms import G, bricard, example, four_bar, spatial_four_bar
from tests.verification.test_reactions import actuated, loads

pytestmark = both_layers


def set_free(r, k):
    """The bodies of a result at its k-th time, without joints, with every load of that instant as a given force."""
    m = fb.Mechanism("set free", planar=r.planar, gravity=r.model.gravity, parameters=r.model.parameters)
    for b in r.model.bodies:
        d, v = r.values.bodies[b.name], r[b.name]
        pose = {"angle": v.angle[k]} if r.planar else {"orientation": v.quaternion[k]}
        m.add(
            fb.Body(
                b.name,
                mass=d.mass,
                inertia=d.inertia[2, 2] if r.planar else d.inertia,
                com=d.com[:2] if r.planar else d.com,
                position=v.position[k],
                velocity=v.velocity[k],
                angular_velocity=v.angular_velocity[k],
                **pose,
            )
        )
    axes = slice(2) if r.planar else slice(3)
    for i, (body, point, force, torque) in enumerate(loads(r)):
        if body != "ground":
            m.add(fb.PointForce(f"force {i}", body, force=force[k, axes], at=point[k, axes]))
            m.add(fb.PointTorque(f"torque {i}", body, torque=torque[k, 2] if r.planar else torque[k]))
    return m


MOVING = {
    "actuated": (actuated, 1.0),
    "four-bar": (four_bar, 0.5),
    "bricard": (bricard, 0.6),
    "spatial four-bar, driven": (lambda: spatial_four_bar(driven=True), 0.4),
    "slider-crank": (lambda: example("slider_crank.toml"), 0.4),
    "governor": (lambda: example("governor.toml"), 0.2),
    "Andrews' mechanism": (lambda: example("andrews.toml"), 0.02),
}


@pytest.mark.parametrize("name", MOVING)
def test_joints_replaced_by_their_reactions(name):
    """Bodies set free in full motion, under the reactions, efforts and forces of that instant: the same accelerations.

    Loads that cancel leave behind what a solve may (1e-13 of its terms), which shows where a body has hardly any inertia.
    """
    make, t_end = MOVING[name]
    r = make().simulate(t_end, outputs=4)
    for k in (1, 3):
        free = set_free(r, k).simulate(1e-9, outputs=2, coordinates="absolute")
        largest = max(max(np.abs(f[k]).max(), np.abs(t[k]).max()) for _, _, f, t in loads(r))
        for b in r.model.bodies:
            d = r.values.bodies[b.name]
            least = {"acceleration": d.mass, "angular_acceleration": np.linalg.eigvalsh(d.inertia)[0]}
            if r.planar:
                least["angular_acceleration"] = d.inertia[2, 2]
            for what, inertia in least.items():
                a = getattr(r[b.name], what)[k]
                rounding = 1e-9 * max(1.0, np.abs(a).max()) + 1e-13 * largest / inertia
                assert getattr(free[b.name], what)[0] == pytest.approx(a, abs=rounding), (b.name, what)


def test_a_crank_held_by_a_force_instead_of_its_bearing():
    """At constant speed the bearing gives m g up and m w^2 r inwards (closed form): as a law, it does for a turn."""
    w, arm, mass = 4.0, 0.3, 2.0
    held = fb.Mechanism("held", planar=True, gravity=(0, -G), parameters={"w": w})
    held.add(fb.Body("crank", mass=mass, inertia=0.1, position=(arm, 0)))
    held.add(fb.Revolute("bearing", "ground", "crank", at=(0, 0)), fb.Driver("motor", "bearing.angle", "w*t"))
    r = held.simulate(np.pi, rtol=1e-11, outputs=41)
    inwards = mass * w * w * arm
    c, s = np.cos(w * r.t), np.sin(w * r.t)
    assert r["bearing"].force == pytest.approx(np.column_stack([-inwards * c, mass * G - inwards * s]), abs=1e-9)
    assert r["motor"].effort == pytest.approx(mass * G * arm * c, abs=1e-9)
    free = fb.Mechanism("free", planar=True, gravity=(0, -G), parameters={"w": w})
    free.add(fb.Body("crank", mass=mass, inertia=0.1, position=(arm, 0), velocity=(0, w * arm), angular_velocity=w))
    law = (f"-{inwards}*cos(w*t)", f"{mass * G} - {inwards}*sin(w*t)")
    free.add(fb.PointForce("bearing", "crank", force=law, at=(0, 0)))
    free.add(fb.PointTorque("motor", "crank", torque=f"{mass * G * arm}*cos(w*t)"))
    f = free.simulate(np.pi, rtol=1e-11, atol=1e-12, outputs=41, coordinates="absolute")
    assert f["crank"].position == pytest.approx(r["crank"].position, abs=1e-7)
    assert f["crank"].angle == pytest.approx(r["crank"].angle, abs=1e-7)


def law_of(t, values, degree=16):
    """A polynomial through a curve, as an expression of t, nested so that no power is formed."""
    fit = np.polynomial.Chebyshev.fit(t, values, degree)
    assert fit(t) == pytest.approx(values, abs=1e-9 * max(1.0, np.abs(values).max()))
    text = "0"
    x = f"(2*t/{float(t[-1])!r} - 1)"
    for c in np.polynomial.chebyshev.cheb2poly(fit.coef)[::-1]:
        text = f"({float(c)!r} + {x}*{text})"
    return text


def test_a_loop_cut_open_goes_on_as_before():
    """The four-bar without its hinge C, whose force over time acts on coupler and rocker instead: the same motion."""
    whole = four_bar()
    whole.add(fb.Initial("A.angle", rate=4.0))
    r = whole.simulate(0.15, rtol=1e-12, atol=1e-13, outputs=61)
    laws = [law_of(r.t, r["C"].force[:, i]) for i in range(2)]
    cut = fb.Mechanism("cut", planar=True, gravity=whole.gravity)
    for b in whole.bodies:
        v = r[b.name]
        cut.add(dataclasses.replace(b, velocity=v.velocity[0], angular_velocity=v.angular_velocity[0]))
    cut.add(*(j for j in whole.joints if j.name != "C"))
    at = whole["C"].at
    cut.add(fb.PointForce("on rocker", "rocker", force=laws, at=at))
    cut.add(fb.PointForce("on coupler", "coupler", force=[f"-({law})" for law in laws], at=at))
    f = cut.simulate(0.15, rtol=1e-11, atol=1e-12, outputs=61)
    assert f.health.freedoms == 3
    for b in whole.bodies:
        assert np.ptp(r["crank"].angle) > 0.3
        assert f[b.name].position == pytest.approx(r[b.name].position, abs=1e-8)
        assert f[b.name].angle == pytest.approx(r[b.name].angle, abs=1e-7)


def turned_round(m):
    """The same mechanism with the two bodies of every joint exchanged, drivers, motors and rates with them."""
    out = fb.Mechanism("turned round", planar=m.planar, gravity=m.gravity, parameters=m.parameters)
    out.add(*m.bodies)
    for j in m.joints:
        given = {"at": j.at[::-1]} if isinstance(j, fb.Distance) else {}
        if isinstance(j, fb.Universal):
            given = {"axes": j.axes[::-1]}
        out.add(dataclasses.replace(j, body_i=j.body_j, body_j=j.body_i, **given))
    for f in m.forces:
        if isinstance(f, fb.Motor):
            f = dataclasses.replace(f, torque="-(2*sin(3*t) + 0.1*rate)")
        elif isinstance(f, fb.TorsionalSpringDamper):
            f = dataclasses.replace(f, angle=-f.angle)
        out.add(f)
    out.add(*(dataclasses.replace(d, law=f"-({d.law})") for d in m.drivers))
    out.add(*(dataclasses.replace(i, rate=-i.rate) for i in m.initial))
    return out


def driven_spatial_four_bar():
    return spatial_four_bar(driven=True)


@pytest.mark.parametrize("make", [actuated, driven_spatial_four_bar, spatial_four_bar, four_bar])
def test_bodies_of_joints_exchanged(make):
    """The same motion, coordinates of the other sign, reverse reactions; torques about the other frame's origin."""
    m = make()
    one = m.simulate(1.0, rtol=1e-11, atol=1e-12, outputs=21)
    two = turned_round(m).simulate(1.0, rtol=1e-11, atol=1e-12, outputs=21)
    for b in m.bodies:
        assert two[b.name].position == pytest.approx(one[b.name].position, abs=1e-8)
        assert two[b.name].rotation == pytest.approx(one[b.name].rotation, abs=1e-8)
        assert two[b.name].acceleration == pytest.approx(one[b.name].acceleration, abs=1e-5)
    for j in m.joints:
        view, other = one[j.name], two[j.name]
        (force, torque), (f, t) = view.reaction(), other.reaction()
        size = max(1.0, np.abs(force).max(), np.abs(torque).max())
        assert f == pytest.approx(-force, abs=1e-7 * size), j.name
        p, o = (np.stack(r.records.frame(r.values.structure.frame_at[j.name, "M", ""])[0], axis=1) for r in (one, two))
        assert t == pytest.approx(-torque - np.cross(p - o, force), abs=1e-7 * size), j.name
        assert other.reaction(on=m.carrier(j.body_j, j))[0] == pytest.approx(force, abs=1e-7 * size)
        for c in j.coordinates:
            partner = {"angle_1": "angle_2", "angle_2": "angle_1"}.get(c, c)
            # a displacement counts along the axis as drawn, on the other body; angles of the inverse rotation are others
            if c != "displacement" and c not in ("roll", "pitch", "yaw", "deflection"):
                assert getattr(other, partner) == pytest.approx(-getattr(view, c), abs=1e-8), (j.name, c)
    for d in m.drivers:
        assert two[d.name].effort == pytest.approx(-one[d.name].effort, abs=1e-7)
        assert two[d.name].work == pytest.approx(one[d.name].work, abs=1e-8)
