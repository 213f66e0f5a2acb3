"""The recording of a result: poses, shapes, lines and joints are where the mechanism has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.results.result import Result
from flyball.tables.structure import structure
from flyball.tables.values import values
from flyball.view.animation import animation_html, record_motion, thinned_times
from flyball.view.page import check_recording
from flyball.view.recording import RecordedArrow, Recording, Shape
from flyball.view.result_plots import plot_curves, write_standard_plots
from flyball.view.still_picture import scene_strokes
from tests.results.made_up import L, R, healthy, mechanism, slider_crank


def turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors turned by unit quaternions."""
    w, u = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def ends(shape: Shape) -> np.ndarray:
    """The two end points of a capsule's line, in the body's axes."""
    half = turned(np.array(shape.quaternion), np.array([0, 0, shape.size[1] / 2]))
    return np.array([shape.position - half, shape.position + half])


def still(m: fb.Mechanism, n: int = 2) -> Result:
    """A mechanism as it is drawn."""
    x = values(structure(m))
    q = np.tile(x.q, (n, 1))
    s = x.structure
    zeros = (np.zeros((n, k)) for k in (s.nv, len(s.states), s.nv, len(s.rows)))
    return Result(m, x, np.arange(float(n)), q, *zeros, healthy())


@pytest.fixture(scope="module")
def result() -> Result:
    return slider_crank()


@pytest.fixture(scope="module")
def recording(result: Result) -> Recording:
    made = record_motion(result)
    check_recording(made)
    return made


def test_poses_are_those_of_the_reference_frames(result: Result, recording: Recording) -> None:
    crank = recording.bodies[0]
    assert np.allclose(crank.p, 0)
    tip = turned(crank.q, np.array([R, 0, 0])) + crank.p
    a = result["crank"].angle
    assert np.allclose(tip, np.stack([R * np.cos(a), R * np.sin(a), 0 * a], 1))


def test_links_reach_from_joint_to_joint(result: Result, recording: Recording) -> None:
    (link,) = recording.bodies[0].shapes
    assert link.kind == "capsule"
    assert np.allclose(sorted(ends(link).tolist()), [[0, 0, 0], [R, 0, 0]])
    rod = recording.bodies[1]
    plate = rod.shapes[0]  # two pins and the dashpot's eye
    assert plate.kind == "plate"
    outline = np.array(plate.outline)
    for corner in ((-L / 2, 0), (L / 2, 0), (0, 0.1)):
        assert (outline.min(0) < corner).all()
        assert (outline.max(0) > corner).all()


def test_a_slider_is_a_block_along_its_guide(recording: Recording) -> None:
    (block,) = recording.bodies[2].shapes
    assert block.kind == "box"
    assert np.allclose(np.abs(turned(np.array(block.quaternion), np.array([0, 0, 1.0]))), [1, 0, 0])
    slide = recording.joints[3]
    assert (slide.kind, slide.body) == ("prismatic", "ground")
    assert np.allclose(slide.axis, [1, 0, 0])
    assert np.allclose(slide.position, [R + L, 0, 0])


def test_joints_ride_on_ground_where_they_are_fixed(recording: Recording) -> None:
    by_name = {j.name: j for j in recording.joints}
    assert by_name["A"].body == "ground"
    assert by_name["B"].body == "crank"
    assert np.allclose(by_name["B"].position, [R, 0, 0])
    assert all(j.kind == "revolute" for j in recording.joints[:3])


def test_springs_dampers_and_forces_are_lines(result: Result, recording: Recording) -> None:
    by_name = {line.name: line for line in recording.lines}
    assert {k: line.kind for k, line in by_name.items()} == {"spring": "spring", "dash/pot": "damper"}
    a, b = by_name["spring"].points
    assert np.allclose(np.linalg.norm(b - a, axis=1), result["spring"].length)


def arrow(recording: Recording, name: str, what: str = "force", body: str = "") -> RecordedArrow:
    (found,) = (a for a in recording.arrows if a.name == name and a.what == what and (not body or a.body == body))
    return found


def test_given_forces_are_arrows_on_their_body(result: Result, recording: Recording) -> None:
    push = arrow(recording, "push")
    assert (push.group, push.body) == ("load", "slider")
    assert np.allclose(push.position, 0)
    assert np.allclose(push.vector[:, 0], 20 * np.sin(2 * np.pi * result.t))
    assert np.allclose(push.vector[:, 1:], 0)


def test_reactions_are_arrows_on_body_j_where_the_joint_is(result: Result, recording: Recording) -> None:
    for name in ("A", "B", "C", "D"):
        drawn = arrow(recording, name)
        assert (drawn.group, drawn.body) == ("reaction", result.model[name].body_j)
        assert np.allclose(drawn.vector[:, :2], result[name].force)
    assert np.allclose(arrow(recording, "B").position, [-L / 2, 0, 0])
    assert np.allclose(arrow(recording, "D", "moment").vector[:, 2], result["D"].torque)
    assert not [a for a in recording.arrows if a.name == "A" and a.what == "moment"]  # a pin carries none


def test_springs_pull_both_of_their_ends_and_drivers_turn_their_joint(result: Result, recording: Recording) -> None:
    tension = result["spring"].force
    pull = arrow(recording, "spring", body="slider").vector
    assert np.allclose(pull[:, 0], tension)  # the spring's other end is on ground, to the right
    assert np.allclose(pull[:, 1:], 0)
    motor = arrow(recording, "motor", "moment")
    assert (motor.group, motor.body) == ("element", "crank")
    assert np.allclose(motor.vector[:, 2], result["motor"].effort)


def test_forces_between_two_bodies_are_equal_and_opposite() -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("a", mass=1, inertia=(1, 1, 1)), fb.Body("b", mass=1, inertia=(1, 1, 1), position=(3, 4, 0)))
    m.add(fb.SpringDamper("s", "a", "b", at=((0, 0, 0), (3, 4, 0)), stiffness=10, length=4))
    recording = record_motion(still(m))
    one, other = arrow(recording, "s", body="a"), arrow(recording, "s", body="b")
    assert np.allclose(one.vector, [[6, 8, 0]] * 2)  # 10 N/m, stretched by 1 m, along (3, 4) / 5
    assert np.allclose(other.vector, -one.vector)


def test_paths_asked_for(result: Result) -> None:
    recording = record_motion(result, paths=["slider", "eye", ("rod", (0.1, 0.2))])
    assert [(p.name, p.body) for p in recording.paths] == [
        ("slider", "slider"),
        ("eye", "rod"),
        ("rod (0.1, 0.2)", "rod"),
    ]
    assert np.allclose(recording.paths[1].position, [0, 0.1, 0])
    assert np.allclose(recording.paths[2].position, [0.1, 0.2, 0])
    check_recording(recording)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"paths": ["slidr"]}, r"no part named 'slidr' \(did you mean 'slider'\?\)"),
        ({"paths": ["motor"]}, "paths: Driver 'motor' has no path; name a body, a frame on a body"),
        ({"paths": [3]}, "paths: 3 is no path; name a body or frame, or give a pair"),
        ({"paths": [("eye", (0, 0))]}, "paths: Frame 'eye' is no body, so it has no points"),
        ({"paths": [("rod", (1, 2, 3))]}, "path of 'rod': the mechanism is planar"),
        (
            {"show": ["reaction"]},
            r"nothing to show named 'reaction' \(did you mean 'reactions'\?\); choose of reactions",
        ),
    ],
)
def test_what_cannot_be_shown_is_refused(result: Result, options: dict, message: str) -> None:
    with pytest.raises(fb.ModelError, match=message):
        result.html(**options)


def test_frames_can_be_shown(result: Result) -> None:
    frames = {f.name: f for f in record_motion(result).frames}
    assert frames["eye"].body == "rod"
    assert np.allclose(frames["eye"].position, [0, 0.1, 0])
    assert np.allclose(turned(np.array(frames["D"].quaternion), np.array([0, 0, 1.0])), [1, 0, 0])


def test_facts_say_what_parts_are(recording: Recording) -> None:
    assert recording.facts["rod"] == ("Body", "1 kg")
    assert recording.facts["B"] == ("Revolute", "crank – rod")
    assert recording.facts["push"] == ("PointForce", "on slider")
    assert recording.facts["motor"] == ("Driver", "A.angle = speed*t")
    assert np.allclose(recording.down, [0, -1, 0])


def test_pages_go_where_they_can_be_written(result: Result, tmp_path: Path) -> None:
    for write in (result.to_html, result.to_report):
        with pytest.raises(
            fb.ModelError, match=r"cannot write '.*page\.html': there is no folder '.*no'; make it first"
        ):
            write(tmp_path / "no" / "page.html")
        with pytest.raises(fb.ModelError, match=r"cannot write .*: it is a folder; name a file in it"):
            write(tmp_path)
        write(tmp_path / "page.html")
        assert (tmp_path / "page.html").stat().st_size > 10_000


def test_a_result_without_times_cannot_be_drawn() -> None:
    nothing = still(mechanism(), 0)
    for draw in (nothing.html, nothing.report):
        with pytest.raises(fb.ModelError, match="'slider/crank' has no output time: there is nothing to plot"):
            draw()


def sphere(rings: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """A finely divided unit sphere about (1, 0, 0)."""
    u, v = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False))
    p = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1).reshape(-1, 3) + [1, 0, 0]
    k = np.arange(len(p)).reshape(2 * rings, rings)
    a, b, c, d = k[:, :-1], k[:, 1:], np.roll(k, -1, 0)[:, :-1], np.roll(k, -1, 0)[:, 1:]
    return p, np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (c, b, d))])


def test_meshes_are_drawn_on_their_body_and_kept_small() -> None:
    m = fb.Mechanism("m")
    vertices, triangles = sphere()
    for name, radius in (("b", 0.5), ("c", 2.0)):
        mesh = fb.Mesh(vertices=radius * vertices, faces=triangles)
        m.add(fb.Body(name, mass=1, inertia=(1, 1, 1), shape=mesh))
    recording = record_motion(still(m))
    check_recording(recording)
    (mesh,) = recording.bodies[0].shapes
    assert mesh.kind == "mesh"
    assert np.allclose(np.sqrt(((mesh.vertices - [0.5, 0, 0]) ** 2).sum(1)), 0.5, rtol=0.01)
    total = sum(len(b.shapes[0].triangles) for b in recording.bodies)
    assert 10_000 < total <= 24_000  # of 178 800
    assert len(animation_html(still(m))) < 1_000_000


def test_holes_are_drawn_as_holes() -> None:
    m = fb.Mechanism("m")
    plate = fb.Box(edges=(1, 1, 0.1))
    bore = fb.Cylinder(radius=0.2, length=0.1, position=(0.2, 0, 0), hole=True)
    m.add(fb.Body("b", density=1, shape=[plate, bore]))
    shapes = record_motion(still(m)).bodies[0].shapes
    assert [(s.kind, s.hole) for s in shapes] == [("box", False), ("cylinder", True)]


def test_a_joint_that_nobody_can_draw_gets_a_mark(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fb.Spherical, "symbol", "strange")
    m = fb.Mechanism("m")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)), fb.Spherical("J", "ground", "b", at=(1, 2, 3)))
    r = still(m)
    (joint,) = record_motion(r).joints
    assert (joint.kind, joint.position) == ("strange", (1, 2, 3))
    assert r.html()


def test_symbols_are_smaller_on_slender_parts() -> None:
    m = fb.Mechanism("m")
    for name, width in (("slender", 0.01), ("stout", 0.3)):
        shape = fb.Box(edges=(2, width, width))
        m.add(
            fb.Body(name, density=1000, shape=shape),
            fb.Revolute(f"J {name}", "ground", name, at=(1, 0, 0), axis=(0, 0, 1)),
        )
    m.add(
        fb.Body("bare", mass=1, inertia=(1, 1, 1)),
        fb.Revolute("J bare", "ground", "bare", at=(1, 0, 0), axis=(0, 0, 1)),
    )
    scale = {j.name: j.scale for j in record_motion(still(m)).joints}
    assert scale == {"J slender": 0.5, "J stout": 1.0, "J bare": 1.0}


def test_curves_and_notes(result: Result, recording: Recording) -> None:
    names = [c.name for c in recording.channels]
    assert len(names) <= 60
    assert set(recording.plotted) <= set(names)
    assert recording.plotted[0] == "motor.effort"
    assert recording.notes["freedoms"] == "0"
    assert "slider/crank" in animation_html(result)


def test_given_shapes_are_kept() -> None:
    m = fb.Mechanism("m")
    cone = fb.Cone(radius=1, height=2, position=(0, 0, 1), orientation=("180 deg", 0, 0))
    m.add(fb.Body("b", density=1, position=(5, 0, 0), shape=[cone, fb.Box(edges=(1, 2, 3), position=(1, 0, 0))]))
    recording = record_motion(still(m))
    check_recording(recording)
    drawn, box = recording.bodies[0].shapes
    assert np.allclose(drawn.position, [0, 0, 0])  # the middle of a cone that hangs from z = 1
    assert box.size == (1.0, 2.0, 3.0)
    assert np.allclose(box.position, [1, 0, 0])
    assert np.allclose(recording.bodies[0].p, [5, 0, 0])


def test_bodies_in_space_get_rods_and_solids() -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("free", mass=12, inertia=(5, 10, 13), orientation=(0.3, 0.2, 0.1)))  # a box of 3, 2, 1
    m.add(fb.Body("top", mass=1, inertia=(0.26, 0.26, 0.5), position=(0, 0, 1)))
    m.add(fb.Body("rod", mass=1, inertia=(1 / 12, 1 / 12, 0), position=(3, 0, 0.5)))
    m.add(fb.Body("three", mass=1, inertia=(1, 1, 1), position=(9, 0, 0)))
    m.add(fb.Spherical("S", "ground", "top", at=(0, 0, 0)), fb.Spherical("T", "ground", "rod", at=(3, 0, 0)))
    for k, x in enumerate((8, 9, 10)):
        m.add(fb.Spherical(f"P{k}", "ground", "three", at=(x, k % 2, 0)))
    m.add(fb.Distance("wire", "free", "top", at=((0, 0, 0), (0, 0, 1))))
    recording = record_motion(still(m))
    check_recording(recording)
    shapes = {b.name: b.shapes for b in recording.bodies}
    top = {s.kind: s for s in shapes["top"]}
    assert "capsule" in top
    (rod,) = shapes["rod"]
    assert np.allclose(sorted(ends(rod).tolist()), [[0, 0, -0.5], [0, 0, 0.5]])
    (plate,) = shapes["three"]
    assert plate.kind == "plate"
    corners = turned(np.array(plate.quaternion), np.c_[np.array(plate.outline), np.zeros(len(plate.outline))])
    corners = corners + plate.position
    assert np.allclose(corners[:, 2], 0)  # it lies in the plane of its three points and encloses them
    assert (corners.min(0)[:2] < [-1, 0]).all()
    assert (corners.max(0)[:2] > [1, 1]).all()
    assert recording.lines[-1].kind == "link"


def test_a_lone_body_looks_like_its_inertia() -> None:
    m = fb.Mechanism("m")
    m.add(fb.Body("free", mass=12, inertia=(5, 10, 13)), fb.Body("ball", mass=1, inertia=(0.4, 0.4, 0.4)))
    m.add(fb.Body("disc", mass=1, inertia=(0.25, 0.25, 0.5)), fb.Body("point", mass=1, inertia=0))
    box, ball, disc, point = (b.shapes[0] for b in record_motion(still(m)).bodies)
    assert box.kind == "box"
    assert np.allclose(sorted(box.size), [1, 2, 3])
    assert ball.kind == "sphere"
    assert np.allclose(ball.size, [1])
    assert disc.kind == "cylinder"
    assert np.isclose(disc.size[0], 1)
    assert point.kind == "sphere"
    assert point.size[0] > 0


def test_long_motions_are_thinned_and_big_mechanisms_show_a_selection() -> None:
    assert (thinned_times(2500) == np.arange(2500)).all()
    few = thinned_times(100_001)
    assert len(few) == 2000
    assert few[0] == 0
    assert few[-1] == 100_000
    m = fb.Mechanism("chain", planar=True)
    for k in range(60):
        m.add(fb.Body(f"b{k}", mass=1, inertia=1 / 12, position=(k + 0.5, 0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
    recording = record_motion(still(m))
    check_recording(recording)
    assert len(recording.channels) == 60
    assert recording.size == pytest.approx(1.0)
    assert np.allclose(sorted(ends(recording.bodies[-1].shapes[0]).tolist()), [[-0.5, 0, 0], [0.5, 0, 0]])


def test_plots_are_written(result: Result, tmp_path: Path) -> None:
    files = write_standard_plots(result, tmp_path)
    assert [f.name for f in files] == ["energy.png", "coordinates.png", "paths.png", "reactions.png", "actuation.png"]
    assert all(f.stat().st_size > 5000 for f in files)
    figure = plot_curves(result, "slider.x", "rod.y", "motor")
    assert [ax.get_ylabel() for ax in figure.axes] == ["length [m]", "effort [N m]", "work [J]"]
    assert [line.get_label() for line in figure.axes[0].lines] == ["slider.x", "rod.y"]
    for suffix in ("svg", "pdf"):
        assert plot_curves(result, "A", path=tmp_path / f"a.{suffix}") is None
        assert (tmp_path / f"a.{suffix}").stat().st_size > 1000


def test_wrong_plots_are_refused(result: Result, tmp_path: Path) -> None:
    with pytest.raises(fb.ModelError, match=r"has no curve 'q'; it has x, y"):
        plot_curves(result, "slider.q")
    with pytest.raises(fb.ModelError, match=r"did you mean 'slider'"):
        plot_curves(result, "slidr")
    with pytest.raises(
        fb.ModelError, match=r"the ending '\.\w+' is not known here; it must be \.png or \.svg or \.pdf"
    ):
        plot_curves(result, path=tmp_path / "a.gif")
    with pytest.raises(fb.ModelError, match=r"cannot write .*a\.png': there is no folder '.*no'; make it first"):
        plot_curves(result, path=tmp_path / "no" / "a.png")


def test_shapes_of_ground_lie_behind_bodies_in_the_plane():
    m = fb.Mechanism("m", planar=True)
    m.add(fb.Body("cart", mass=1, inertia=1, shape=fb.Box(edges=(1, 1, 1)), color="#ff0000"))
    m.add(fb.Ground("wall", shape=fb.Box(edges=(2, 2, 1)), color="#0000ff"))
    recording = record_motion(still(m))
    assert [(b.name, b.ground) for b in recording.bodies] == [("cart", False), ("wall", True)]
    assert [s.fill for s in scene_strokes(recording)] == ["#0000ff", "#ff0000"]


def test_a_body_without_a_shape_is_seen_on_its_way():
    m = fb.Mechanism("kick", gravity=(0, 0, -9.81))
    m.add(fb.Body("ball", mass=0.4, inertia=(0.004, 0.004, 0.004), velocity=(100, 0, 0)))
    (shape,) = record_motion(m.simulate(1.0, outputs=3)).bodies[0].shapes
    assert shape.size == pytest.approx((0.012 * 100.0,))
