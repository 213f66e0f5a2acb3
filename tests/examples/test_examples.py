"""Every example loads, moves, keeps its constraints and its energy, and survives its file."""

import runpy

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import EXAMPLES

EVERY = sorted(p.name for p in EXAMPLES.iterdir() if p.suffix in (".toml", ".py"))
CONTACT = {  # see test_contact_examples
    "bin_picking.py",  # and verification/test_granular, as the other granular ones
    "conveyor.toml",
    "dominoes.py",
    "gripper.py",
    "hourglass.py",
    "labyrinth.py",
    "newtons_cradle.py",
    "pile_in_a_box.py",
    "rocking_block.toml",  # and test_events
    "rotating_drum.py",
    "silo.py",  # and verification/test_silo
    "tippe_top.py",
    "tracked_vehicle.py",  # verification/test_tracks
    "wheel_in_gravel.py",
    "tracked_vehicle_in_space.py",  # verification/test_tracks_in_space
    "woodpecker.py",  # and verification/test_woodpecker
    "wrecking_ball.py",
}
# test_robots, verification/test_seven_axes
ROBOTS = {
    "delta_robot.py",
    "five_bar.py",
    "hexapod_postures.py",
    "quadruped.py",
    "robot_arm_circle.py",
    "seven_axes.py",
}
STANDS = {"inverted_pendulum.py"}  # until it is held, see test_inverted_pendulum
FILES = [name for name in EVERY if name not in CONTACT | STANDS | ROBOTS]
EVENTS = {  # see test_events: what holds in them changes at instants, or may
    "bouncing_ball.toml",
    "cam_follower.toml",
    "clock_escapement.toml",
    "crane.toml",
    "gear_backlash.toml",
    "geneva_drive.toml",
    "ratchet.toml",
    "safety_brake.toml",
    "truck.py",
}
LARGE = {"truck.py", "bogie_on_rollers.py"}  # roads and profiles are tables, which are not written out with symbols
EQUATIONS = [name for name in FILES if name not in EVENTS | LARGE]
"""Those with one set of equations for all times, friction by its direction."""
PREPARED = [name for name in EQUATIONS if name != "governor_pi.py"]
"""Those without controllers, whose states `prepare` does not support."""
PROMISED = {
    "andrews.toml",
    "bennett.py",
    "bogie.py",
    "bogie_on_rollers.py",
    "bricard.toml",
    "bouncing_ball.toml",
    "cam.py",
    "cam_follower.toml",
    "capstan.toml",
    "crane.toml",
    "car.toml",
    "car_axis.toml",
    "cart_pole_swing_up.py",
    "chaplygin_sleigh.toml",
    "clock_escapement.toml",
    "clutch_start.toml",
    "differential.py",
    "double_wishbone.toml",
    "excavator.py",
    "gear_backlash.toml",
    "geneva_drive.toml",
    "governor.toml",
    "governor_criterion.py",
    "governor_pi.py",
    "heavy_top.toml",
    "inverted_pendulum.py",
    "linkages.py",
    "n_four_bar.py",
    "oldham.toml",
    "parallel_platforms.py",
    "peaucellier.toml",
    "pendulum_chain.py",
    "planetary.py",
    "point_mass_pendulum.toml",
    "press.py",
    "quick_return.toml",
    "ratchet.toml",
    "rattleback.toml",
    "rolling_disk.toml",
    "rolling_race.toml",
    "rope_pendulum.toml",
    "safety_brake.toml",
    "schatz.py",
    "slider_crank.toml",
    "slider_crank_singularities.py",
    "spatial_four_bar.toml",
    "spatial_slider_crank.toml",
    "stewart.py",
    "stick_slip.toml",
    "t_handle.toml",
    "thin_rod.toml",
    "toggle_press.toml",
    "truck.py",
    "two_shafts.py",
}
REDUNDANT = {
    "bennett.py": 3,
    "bricard.toml": 1,
    "differential.py": 1,
    "planetary.py": 2,
    "schatz.py": 1,
    "geneva_drive.toml": 1,
}  # rows that say nothing new, on purpose
WAY = {"bogie.py": 0.01, "cam_follower.toml": 0.01}  # what moves least [m]
SECONDS = {"governor.toml": 0.2, "andrews.toml": 0.05}  # to be seen of what moves fast; 1 s of the others


def mechanism(name, **options):
    path = EXAMPLES / name
    return runpy.run_path(str(path))["mechanism"](**options) if path.suffix == ".py" else fb.load(path)


def test_all_that_was_promised_is_there():
    assert set(EVERY) >= PROMISED | CONTACT | ROBOTS


@pytest.mark.parametrize("name", FILES)
def test_example_is_sound(name):
    m = mechanism(name)
    report = m.check()
    assert report.redundancy == REDUNDANT.get(name, 0)
    assert report.moved == {}
    r = m.simulate(SECONDS.get(name, 1.0), outputs=101, rtol=1e-8)
    assert r.health.success
    assert r.health.violation < 1e-9
    assert r.health.velocity_violation < 1e-8
    moved = max(np.ptp(r[b.name].rotation, axis=0).max() + np.ptp(r[b.name].position, axis=0).max() for b in m.bodies)
    assert moved > WAY.get(name, 0.1)
    exchanged = np.ptp(r.energy.kinetic) + np.ptp(r.energy.potential) + 0.1 * r.energy.kinetic.max()
    assert r.energy.drift < 1e-6 * exchanged
    assert all(np.isfinite(v).all() for _, v in r.channels().values())


@pytest.mark.parametrize("name", EVERY)
def test_example_survives_its_file(name, tmp_path):
    """Saved and loaded it is equal, part by part, and starts bit for bit the same."""
    m = mechanism(name)
    m.save(tmp_path / "again.toml")
    again = fb.load(tmp_path / "again.toml")
    assert again == m
    one, two = m.assemble(), again.assemble()
    assert np.array_equal(one.q, two.q)
    assert np.array_equal(one.v, two.v)
    again.save(tmp_path / "twice.toml")
    assert (tmp_path / "again.toml").read_bytes() == (tmp_path / "twice.toml").read_bytes()


@pytest.mark.parametrize("name", FILES)
def test_example_opens_with_a_sentence(name):
    """The file says what it shows before anything else."""
    first = (EXAMPLES / name).read_text(encoding="utf-8").lstrip()
    assert first.startswith(("#", '"""'))
    assert len(first.splitlines()[0]) > 30


@pytest.mark.parametrize("name", FILES)
def test_example_is_drawn(name):
    """Every part of it has a place in the recording that pictures and the page are made of."""
    from flyball.view.animation import record_motion
    from flyball.view.page import pack_recording

    r = mechanism(name).simulate(0.1, outputs=5)
    recording = record_motion(r)
    assert {b.name for b in recording.bodies} == {b.name for b in (*r.model.bodies, *r.model.ground)}
    assert pack_recording(recording)


def test_examples_with_events_are_known():
    assert {name for name in FILES if (m := mechanism(name)).events or m.limits} == EVENTS
