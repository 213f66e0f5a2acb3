"""Sets of many bodies and contact forces, packed and on the page: exact to their grids, light, and all drawn at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from flyball.view.page import (
    RANGE_16_BIT,
    RANGE_32_BIT,
    animation_page,
    pack_forces,
    pack_orientations,
    pack_positions,
    pack_recording,
)
from flyball.view.recording import (
    RecordedBody,
    RecordedContacts,
    RecordedJoint,
    RecordedPath,
    RecordedSet,
    Recording,
    Shape,
    group_bodies,
)
from tests.view.conftest import Opened

Open = Callable[..., Opened]
RADIUS = 0.1


def rolling(m: int = 1000, n: int = 60, flat: bool = False) -> Recording:
    """Balls that roll down a slope side by side, each its own way, and jump now and then."""
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 2.0, n)
    side = int(np.ceil(np.sqrt(m)))
    start = np.stack([np.arange(m) % side, np.arange(m) // side, 0 * np.arange(m)], axis=1) * 2.5 * RADIUS
    way = rng.uniform(0.5, 1.5, m) * t[:, None] ** 2
    p = np.tile(start, (n, 1, 1)) + RADIUS * np.array([0, 0, 1.0])
    p[:, :, 0] += way
    hop = np.abs(np.sin(rng.uniform(2, 5, m) * t[:, None]))
    if flat:
        p[:, :, 2] = 0.0
        p[:, :, 1] += hop
    else:
        p[:, :, 2] += hop
    q = np.zeros((n, m, 4))
    q[:, :, 0] = np.cos(way / RADIUS / 2)
    q[:, :, 3 if flat else 2] = np.sin(way / RADIUS / 2)
    return Recording(
        "rolling", flat, t, (), sets=(RecordedSet("balls", (Shape("sphere", (RADIUS,)),), p, q),), size=0.3
    )


def summed(changes: np.ndarray, n: int, m: int, width: int) -> np.ndarray:
    """What the page does: (n, m, 3) whole numbers."""
    return (np.cumsum(changes.reshape(n, 3, m), axis=0) % width).transpose(0, 2, 1)


def test_packed_positions_come_back_to_a_thousandth_of_a_body():
    p = rolling().sets[0].p.copy()
    p[40:, 7] = np.nan
    changes, about = pack_positions(p, RADIUS)
    grid = summed(changes, *p.shape[:2], RANGE_16_BIT if about["type"] == "u2" else RANGE_32_BIT)
    back = np.array(about["low"]) + about["step"] * grid
    there = np.isfinite(p).all(axis=2)
    assert np.abs(back - p)[there].max() <= 0.5 * 1e-3 * RADIUS * (1 + 1e-9)
    assert (grid[~there] == 0).all()
    assert (grid[there] > 0).all()


def test_far_apart_bodies_get_wider_numbers():
    p = np.array([[[0.0, 0, 0], [1e4, 0, 0]], [[0.0, 0, -5e3], [1e4, 3.0, 0]]])
    changes, about = pack_positions(p, RADIUS)
    assert about["type"] == "u4"
    back = np.array(about["low"]) + about["step"] * summed(changes, 2, 2, RANGE_32_BIT)
    np.testing.assert_allclose(back, p, atol=1e-3 * RADIUS)


def test_packed_orientations_come_back():
    rng = np.random.default_rng(1)
    q = rng.normal(size=(5, 400, 4))
    q /= np.sqrt((q * q).sum(axis=2, keepdims=True))
    q[0, 0], q[1, 0] = (1, 0, 0, 0), (0, 1, 0, 0)  # none, and half a turn
    grid = summed(pack_orientations(q), 5, 400, RANGE_16_BIT)
    turn = np.where(grid >= RANGE_16_BIT // 2, grid - RANGE_16_BIT, grid) * (2 * np.pi / (RANGE_16_BIT - 1))
    angle = np.sqrt((turn**2).sum(axis=2))
    back = np.concatenate([np.cos(angle / 2)[..., None], np.sinc(angle / 2 / np.pi)[..., None] * turn / 2], axis=2)
    assert (1 - np.abs((back * q).sum(axis=2))).max() < 1e-8  # 1 - cos(angle / 2) of 2e-4 rad


def test_packed_forces_keep_small_ones():
    f = np.array([[1000.0, 0, 0], [0, -1.0, 0], [0, 0, 0.01]])
    packed, largest = pack_forces(f)
    root = packed / 32767 - 1
    np.testing.assert_allclose(np.sign(root) * root**2 * largest, f, rtol=0.02, atol=1e-5)


def test_a_thousand_balls_for_two_seconds_are_a_small_page():
    assert len(animation_page(rolling())) < 2.5e6
    bare = len(pack_recording(dataclasses.replace(rolling(), sets=())))
    assert len(pack_recording(rolling())) - bare < 18.1 * 60_000  # bytes a pose, before compression


@pytest.mark.parametrize("flat", [False, True])
def test_members_stand_where_the_recording_says(opened: Open, flat: bool) -> None:
    recording = rolling(30, 21, flat)
    p = recording.sets[0].p.copy()
    p[10:, 3] = np.nan
    other = dataclasses.replace(recording.sets[0], p=p, scale=np.linspace(0.5, 1.0, 30))
    recording = dataclasses.replace(recording, sets=(other,))
    tab = opened(animation_page(recording))
    for k in (0, 13, 20):
        shown = np.array(tab.evaluate("(t) => (flyball.seek(t), flyball.poses('balls'))", float(recording.t[k])))
        there = np.isfinite(p[k]).all(axis=1)
        np.testing.assert_allclose(shown[there, :3], p[k][there], atol=1e-3 * RADIUS)
        same = np.abs((shown[there, 3:] * other.q[k][there]).sum(axis=1))
        np.testing.assert_allclose(same, 1.0, atol=1e-7)
    half = float(recording.t[4] + recording.t[5]) / 2
    shown = np.array(tab.evaluate("(t) => (flyball.seek(t), flyball.poses('balls'))", half))
    np.testing.assert_allclose(shown[:, :3], (p[4] + p[5]) / 2, atol=1e-3 * RADIUS)
    assert tab.errors == []
    assert tab.foreign == []


def test_a_thousand_take_as_many_commands_as_ten(opened: Open) -> None:
    calls = []
    for m in (10, 1000):
        tab = opened(animation_page(rolling(m)))
        tab.evaluate("flyball.seek(1)")
        tab.settle()
        calls.append(tab.evaluate("flyball.drawn().calls"))
    assert calls[0] == calls[1] < 12


def test_members_have_names_and_can_be_chosen(opened: Open) -> None:
    tab = opened(animation_page(rolling(16)))
    x, y = tab.evaluate("flyball.pixel('balls[5]')")
    assert tab.evaluate("([x, y]) => flyball.pick(x, y)", [x, y]) == "balls[5]"
    tab.evaluate("flyball.select('balls[5]')")
    assert tab.evaluate("flyball.selected()") == "balls[5]"
    assert tab.locator(".card h2").inner_text() == "balls[5]"
    assert tab.locator(".subtitle").inner_text().startswith("16 bodies")
    assert tab.locator(".legend li").first.inner_text() == "balls (16)"
    assert tab.errors == []


def test_many_single_bodies_are_drawn_as_sets(opened: Open) -> None:
    s = rolling(500, 5).sets[0]
    names = [f"{'ball' if k % 2 else 'brick'} {k}" for k in range(500)]
    box = Shape("box", (RADIUS, RADIUS, RADIUS))
    bodies = [RecordedBody(x, (s.shapes[0] if k % 2 else box,), s.p[:, k], s.q[:, k]) for k, x in enumerate(names)]
    path = RecordedPath("path", "ball 7")
    whole = Recording("many", False, rolling(500, 5).t, tuple(bodies), paths=(path,), size=0.3)
    grouped = group_bodies(whole)
    assert [b.name for b in grouped.bodies] == ["ball 7"]  # something is fixed on it
    assert [(x.name, len(x.names)) for x in grouped.sets] == [
        ("brick 0 ... brick 498", 250),
        ("ball 1 ... ball 499", 249),
    ]
    tab = opened(animation_page(grouped))
    x, y = tab.evaluate("flyball.pixel('brick 498')")
    assert tab.evaluate("([x, y]) => flyball.pick(x, y)", [x, y]) == "brick 498"
    shown = np.array(tab.evaluate("flyball.poses('brick 0 ... brick 498')"))
    np.testing.assert_allclose(shown[:, :3], s.p[0, ::2], atol=1e-3 * RADIUS)
    assert tab.errors == []


def pressed(flat: bool = False) -> Recording:
    """A block on two points that press with more and more force; then one of them slips."""
    t = np.linspace(0.0, 1.0, 11)
    still = np.tile([1.0, 0, 0, 0], (t.size, 1))
    block = RecordedBody("block", (Shape("box", (1.0, 0.5, 0.4)),), np.zeros((t.size, 3)), still)
    up = np.array([0.0, 1, 0]) if flat else np.array([0.0, 0, 1])
    point = np.tile([[-0.5, 0, 0], [0.5, 0, 0]] - 0.25 * up, (t.size, 1))
    force = np.repeat(10.0 + t, 2)[:, None] * up
    state = np.tile([0, 1], t.size)
    contacts = RecordedContacts(2 * np.arange(t.size + 1), point, force, state)
    return Recording("pressed", flat, t, (block,), contacts=contacts, size=1.0, show=("contacts",))


@pytest.mark.parametrize("flat", [False, True])
def test_contact_forces_are_arrows_where_and_as_large_as_recorded(opened: Open, flat: bool) -> None:
    recording = pressed(flat)
    tab = opened(animation_page(recording), "t=0.5")
    shown = tab.evaluate("flyball.contacts()")
    assert [a["state"] for a in shown] == ["stick", "slip"]
    contacts = recording.contacts
    assert contacts is not None
    np.testing.assert_allclose([a["at"] for a in shown], contacts.point[10:12], atol=1e-4)
    np.testing.assert_allclose([a["vector"] for a in shown], contacts.force[10:12], atol=2e-3)
    legend = tab.locator(".forces").inner_text()
    assert "Contacts that stick" in legend
    assert "Contacts that slip" in legend
    assert tab.evaluate("flyball.shown()") == ["contacts"]
    assert tab.errors == []


def test_incomplete_sets_and_contacts_are_refused():
    r = rolling(4, 5)
    s = r.sets[0]
    for wrong in ({"q": s.q[:, :3]}, {"p": s.p[:4]}, {"scale": np.zeros(4)}, {"shapes": ()}):
        with pytest.raises(ValueError, match="set 'balls'"):
            pack_recording(dataclasses.replace(r, sets=(dataclasses.replace(s, **wrong),)))
    c = pressed().contacts
    assert c is not None
    with pytest.raises(ValueError, match="contacts"):
        pack_recording(dataclasses.replace(pressed(), contacts=dataclasses.replace(c, begin=c.begin[1:])))
    with pytest.raises(ValueError, match="two bodies are named 'balls'"):
        pack_recording(dataclasses.replace(r, sets=(s, s)))


@pytest.mark.parametrize("planar", [False, True])
def test_many_jointed_bodies_take_few_commands(opened: Open, planar: bool) -> None:
    """Bodies with joints are no sets: their solids and symbols are drawn together all the same."""
    t, n = np.linspace(0.0, 1.0, 3), 400
    still = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    places = [np.tile([k % 20, k // 20, 0.0], (3, 1)) + 0.1 * t[:, None] for k in range(n)]
    shape = (Shape("box", (0.8, 0.3, 0.3)), Shape("capsule", (0.02, 0.9)))
    bodies = tuple(RecordedBody(f"link {k}", shape, p, still) for k, p in enumerate(places))
    kind = "revolute" if planar else "spherical"
    joints = tuple(RecordedJoint(f"pin {k}", kind, f"link {k}", (0.4, 0, 0), (0, 0, 1)) for k in range(n))
    tab = opened(animation_page(Recording("chain", planar, t, bodies, joints=joints)), "t=0&view=top")
    tab.settle()
    assert tab.evaluate("flyball.drawn().calls") < 20
    for time in (0.0, 1.0):
        tab.evaluate(f"flyball.seek({time})")
        tab.settle()
        x, y = tab.evaluate("flyball.pixel('link 210')")
        assert tab.evaluate("([x, y]) => flyball.pick(x, y)", [x, y]) == "link 210"
    assert tab.errors == []
