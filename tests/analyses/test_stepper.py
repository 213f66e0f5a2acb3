"""Stepping from outside: the same motion as `simulate`, states that repeat to the last bit, refusals."""

import numpy as np
import pytest

import flyball as fb

NAMES = ["rail.displacement", "rail.displacement_rate", "pin.angle", "pin.angle_rate", "pole.y"]


def cart_pole(force: str = "0", **parameters: float) -> fb.Mechanism:
    m = fb.Mechanism("cart and pole", planar=True, gravity=(0, -9.81), parameters=parameters)
    m.add(fb.Body("cart", mass=1.0, inertia=0.1), fb.Body("pole", mass=0.1, inertia=0.01, position=(0, 0.5)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "pole", at=(0, 0)), fb.Actuator("push", "rail.displacement", force=force))
    return m


def scene(floor: bool = True) -> fb.Mechanism:
    """A jointed leg, a ball and a brick that fall on a floor."""
    m = fb.Mechanism("scene", gravity=(0, 0, -9.81))
    m.add(fb.Body("trunk", shape=fb.Box(edges=(0.3, 0.2, 0.1)), density=500, position=(0, 0, 0.6)))
    m.add(fb.Body("leg", shape=fb.Capsule(radius=0.03, length=0.3), density=500, position=(0, 0, 0.35)))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.05), density=500, position=(1, 0, 0.3), angular_velocity=(0, 2, 3)))
    m.add(fb.Body("brick", shape=fb.Box(edges=(0.2, 0.1, 0.05)), density=500, position=(0, 1, 0.3),
                  angular_velocity=(1, 2, 3)))  # fmt: skip
    m.add(fb.Frame("corner", "brick", position=(0.1, 0.05, 0.025)))
    m.add(fb.Revolute("hip", "trunk", "leg", at=(0, 0, 0.55), axis=(0, 1, 0)), fb.Motor("torque", "hip", torque="0"))
    if floor:
        m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact("touch", friction=0.7, restitution=0.2))
    return m


SCENE = ["hip.angle", "hip.angle_rate", "trunk.z", "ball.x", "brick.vz"]


def test_the_motion_is_that_of_simulate():
    sim = cart_pole().stepper(0.02, inputs=["push"], outputs=NAMES, rtol=1e-9)
    y = [sim.outputs(), *(sim.step([1.5]) for _ in range(50))]
    run = cart_pole("1.5").simulate(1.0, outputs=51, rtol=1e-11)
    assert np.allclose(y, np.column_stack([run[name] for name in NAMES]), rtol=0, atol=1e-9)
    assert sim.t == 1.0


def test_inputs_are_held_during_steps():
    """Force on a free cart: closed form of piecewise constant acceleration."""
    m = fb.Mechanism("cart", planar=True)
    m.add(fb.Body("cart", mass=2.0, inertia=1.0), fb.Prismatic("A", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Actuator("push", "A.displacement", force="3"))
    sim = m.stepper("0.1 s", inputs=["push"], outputs=["A.displacement", "A.displacement_rate"])
    x = v = 0.0
    for u in (1.0, -4.0, 0.0, 2.5, 2.5):
        a = (3.0 + u) / 2.0
        x, v = x + 0.1 * v + 0.005 * a, v + 0.1 * a
        assert np.allclose(sim.step([u]), [x, v], rtol=1e-12, atol=1e-14)
    a = (3.0 + 2.5) / 2.0
    assert np.allclose(sim.step(steps=3), [x + 0.3 * v + 0.045 * a, v + 0.3 * a], rtol=1e-12)  # the last input is kept
    assert sim.t == pytest.approx(0.8)


def test_a_parameter_of_laws_is_an_input():
    m = cart_pole("kp*(target - value) - 2*rate", kp=4.0, target=0.2)
    sim = m.stepper(0.05, inputs=["target"], outputs=NAMES, rtol=1e-9)
    assert np.allclose(sim.step(), m.simulate(0.05, rtol=1e-11)[NAMES[0]][-1:].tolist() + sim.outputs()[1:].tolist())
    sim.reset()
    run = m.simulate(1.0, parameters={"target": -0.3}, rtol=1e-11)
    y = [sim.step([-0.3]) for _ in range(20)][-1]
    assert np.allclose(y, [run[name][-1] for name in NAMES], rtol=0, atol=1e-8)


@pytest.mark.parametrize("jump", ["0.0123", "0.02", "1.2/60"])  # within a step, and at the end of one
@pytest.mark.parametrize("dt", [0.01, 1 / 300])
def test_a_law_that_jumps_in_time_is_met(jump, dt):
    m = cart_pole(f"where(t < {jump}, 100, 0)")
    sim = m.stepper(dt, outputs=NAMES)
    for _ in range(round(0.05 / dt)):
        y = sim.step()
    run = m.simulate(0.05, rtol=1e-11)
    assert np.allclose(y, [run[name][-1] for name in NAMES], rtol=0, atol=1e-6)


def test_breakpoints_follow_inputs():
    """They are found for many steps at once, and again for a new value."""
    m = cart_pole("where(t < until, 100, 0)", until=0.033)
    sim = m.stepper(0.01, inputs=["until"], outputs=NAMES)
    for until in (0.033, 0.033, 0.0312, 0.0312, 0.0312):
        y = sim.step([until])
    run = m.simulate(0.05, parameters={"until": 0.0312}, rtol=1e-11)
    assert np.allclose(y, [run[name][-1] for name in NAMES], rtol=0, atol=1e-6)


def test_continuous_controllers_and_loops():
    m = cart_pole()
    m.add(fb.PID("pid", setpoint="0.1", measured="rail.displacement", kp=8, ki=2, kd=3, filter="20 ms"))
    m.add(fb.Actuator("servo", "rail.displacement", force="pid"))
    sim = m.stepper(0.02, outputs=NAMES, rtol=1e-9)
    run = m.simulate(0.4, rtol=1e-11)
    y = [sim.step() for _ in range(20)][-1]
    assert np.allclose(y, [run[name][-1] for name in NAMES], rtol=0, atol=1e-8)
    four_bar = fb.load("examples/spatial_four_bar.toml")
    joint = next(j for j in four_bar.joints if "angle" in j.coordinates)
    name = f"{joint.name}.angle"
    sim = four_bar.stepper(0.01, outputs=[name])
    y = [sim.step()[0] for _ in range(30)]
    assert np.allclose(y, four_bar.simulate(0.3, outputs=31, rtol=1e-10)[name][1:], rtol=0, atol=1e-5)


def test_contact_is_that_of_impulse_time_stepping():
    m = scene()
    sim = m.stepper(0.01, inputs=["torque"], outputs=SCENE)
    assert sim.method.startswith("impulse time stepping: for Contact 'touch'")
    y = [sim.outputs(), *(sim.step() for _ in range(60))]
    run = m.simulate(0.6, method=fb.Stepping(step=0.005), outputs=61)
    assert np.allclose(y, np.column_stack([run[name] for name in SCENE]), rtol=0, atol=1e-12)
    p, R = sim.pose("corner")
    v, w = sim.velocity("corner")
    for found, name in ((p, "position"), (v, "velocity"), (w, "angular_velocity")):
        assert np.allclose(found, getattr(run["corner"], name)[-1], rtol=0, atol=1e-12)
    assert np.allclose(R, run["corner"].rotation[-1], atol=1e-12)
    assert np.allclose(sim.q, run.q[-1], atol=1e-12)
    assert np.allclose(sim.v, run.v[-1], atol=1e-12)


@pytest.mark.parametrize("make", [lambda: scene(), lambda: scene(floor=False)])
def test_a_saved_state_repeats_to_the_last_bit(make):
    sim = make().stepper(0.02, inputs=["torque"], outputs=SCENE)
    for _ in range(8):
        sim.step([0.5])
    saved = sim.state
    later = [sim.step([k * 0.1]) for k in range(30)]
    sim.state = saved
    assert sim.t == pytest.approx(0.16)
    assert np.array_equal(later, [sim.step([k * 0.1]) for k in range(30)])
    sim.reset()
    assert np.array_equal(sim.outputs(), make().stepper(0.02, inputs=["torque"], outputs=SCENE).outputs())


def test_a_state_survives_the_enlargement_of_tables():
    """A pile whose contacts grow after the state was saved; then back and forth between both sizes."""
    m = fb.Mechanism("pile", gravity=(0, 0, -9.81))
    m.add(fb.Ground("floor", shape=fb.Plane()), fb.Contact("touch", friction=0.5))
    for i in range(6):
        for j in range(6):
            at = (0.21 * i, 0.21 * j, 0.3 + 0.02 * j)
            m.add(fb.Body(f"b{i}{j}", shape=fb.Box(edges=(0.2, 0.2, 0.2)), density=500, position=at))
    sim = m.stepper(0.02, outputs=["b00.z", "b35.z", "b55.x"])
    early = sim.state
    first = [sim.step() for _ in range(25)]
    late = sim.state
    more = [sim.step() for _ in range(5)]
    sim.state = early
    assert np.array_equal(first, [sim.step() for _ in range(25)])
    sim.state = late
    assert np.array_equal(more, [sim.step() for _ in range(5)])


@pytest.mark.parametrize("floor", [True, False])
def test_copies_are_independent_and_equal_on_threads(floor):
    m, u = scene(floor), np.linspace(-1, 1, 5)[:, None]
    sims = [m.stepper(0.02, inputs=["torque"], outputs=SCENE, copies=5, threads=k) for k in (1, 2)]
    for _ in range(20):
        y = [sim.step(u) for sim in sims]
    assert np.array_equal(*y)
    alone = m.stepper(0.02, inputs=["torque"], outputs=SCENE)
    for _ in range(20):
        z = alone.step(u[1])
    assert np.array_equal(y[0][1], z)
    assert sims[0].pose("trunk")[1].shape == (5, 3, 3)
    before = sims[0].outputs()
    sims[0].reset(copy=3)
    assert (sims[0].outputs() == before).all(axis=1).tolist() == [True, True, True, False, True]
    assert sims[0].t.tolist() == pytest.approx([0.4, 0.4, 0.4, 0.0, 0.4])


def test_reset_to_other_values():
    sim = cart_pole().stepper(0.02, inputs=["push"], outputs=NAMES, rtol=1e-9)
    y = sim.reset({"pin.angle": 0.3, "rail.displacement": (0.2, -1.0)})
    assert y[[0, 1, 2]] == pytest.approx([0.2, -1.0, 0.3], abs=1e-12)
    assert y[4] == pytest.approx(0.5 * np.cos(0.3))
    m = cart_pole()
    m.add(fb.Initial("pin.angle", value=0.3), fb.Initial("rail.displacement", value=0.2, rate=-1.0))
    run = m.simulate(0.2, rtol=1e-11)
    y = [sim.step() for _ in range(10)][-1]
    assert np.allclose(y, [run[name][-1] for name in NAMES], rtol=0, atol=1e-8)
    sim.reset()
    assert sim.outputs()[:4].tolist() == [0, 0, 0, 0]


def test_angles_count_whole_turns():
    m = fb.Mechanism("top")
    m.add(fb.Body("disc", mass=1, inertia=(1, 1, 2), angular_velocity=(0, 0, 20)))
    m.add(fb.Revolute("A", "ground", "disc", at=(0, 0, 0), axis=(0, 0, 1)))
    for coordinates in ("joint", "absolute"):
        sim = m.stepper(0.1, outputs=["A.angle"], coordinates=coordinates)
        assert [sim.step()[0] for _ in range(10)] == pytest.approx(2.0 * np.arange(1, 11), abs=1e-5)


def test_states_are_those_of_prepare():
    """Computed torque outside: the accelerations asked for are those of the motion."""
    m = scene(floor=False).changed({"ball": None, "brick": None, "corner": None})
    p, sim = m.prepare(coordinates="joint"), m.stepper(1e-3, inputs=["torque"], coordinates="joint")
    assert sim.names == p.names
    tau = np.where(np.array(sim.names) == "hip.angle", 0.7, 0.0)
    vdot, v = p.aba(sim.q, sim.v, tau), sim.v
    sim.step([0.7])
    assert np.allclose((sim.v - v) / 1e-3, vdot, rtol=0, atol=1e-2)


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (cart_pole, {"inputs": ["pull"]}, "has no input 'pull'.*push"),
        (cart_pole, {"inputs": ["push", "push"]}, "named twice"),
        (cart_pole, {"outputs": ["pin.angel"]}, "pin.*no curve 'angel'.*angle"),
        (cart_pole, {"outputs": ["cart.ax"]}, "'cart.ax' cannot be an output.*positions"),
        (cart_pole, {"dt": 0.0}, "dt must be greater than 0"),
        (cart_pole, {"copies": 0}, "copies"),
        (cart_pole, {"method": "radau"}, "radau"),
        (lambda: cart_pole("M", M=1.0).changed({"cart": fb.Body("cart", mass="M", inertia=0.1)}), {"inputs": ["M"]},
         "'M' cannot be an input.*'cart'"),
        (scene, {"method": "dop853"}, "method='dop853' does not support Contact 'touch'"),
        (scene, {"step": 0.001}, "takes its step as method=fb.Stepping"),
        (scene, {"rtol": 1e-3}, "rtol has no effect"),
        (cart_pole, {"threads": 2}, "threads divide copies"),
        (scene, {"coordinates": "joint"}, "uses absolute coordinates; leave coordinates='joint' out"),
    ],
)  # fmt: skip
def test_refusals_name_what_is_wrong(make, options, message):
    with pytest.raises(fb.ModelError, match=message):
        make().stepper(options.pop("dt", 0.01), **options)


def test_drivers_events_and_sampled_controllers_are_refused():

    def crank(part: fb.Driver | fb.Event | fb.State) -> fb.Mechanism:
        m = fb.Mechanism("crank", planar=True, parameters={"u": 0.0})
        m.add(fb.Body("crank", mass=1, inertia=1), fb.Revolute("A", "ground", "crank", at=(0, 0)), part)
        return m

    for name in ("u", "d"):
        with pytest.raises(fb.ModelError, match="it sets the position of Driver 'd'"):
            crank(fb.Driver("d", "A.angle", law="u")).stepper(0.01, inputs=[name])
    with pytest.raises(fb.ModelError, match="does not support Event 'past'"):
        crank(fb.Event("past", when="A.angle > 1", do=fb.Note("past"))).stepper(0.01)
    with pytest.raises(fb.ModelError, match="does not sample State 'x'"):
        crank(fb.State("x", next="x + 1", period="1 ms")).stepper(0.01)


def test_bad_arrays_are_refused():
    sim = cart_pole().stepper(0.01, inputs=["push"])
    with pytest.raises(fb.ModelError, match=r"have the shape \(1,\) \(push\), not \(2,\)"):
        sim.step([1.0, 2.0])
    with pytest.raises(fb.ModelError, match="finite"):
        sim.step([np.nan])
    with pytest.raises(fb.ModelError, match="copy is a number"):
        sim.reset(copy=1)
    with pytest.raises(fb.ModelError, match="state"):
        sim.state = 1
    with pytest.raises(fb.ModelError, match="steps"):
        sim.step([0.0], steps=0)
    with pytest.raises(fb.AssemblyError):
        sim.reset({"cart.y": 1.0})


def test_a_motion_that_cannot_continue_says_why():
    m = cart_pole("1/(0.01 - value)")
    sim = m.stepper(0.05)
    with pytest.raises(fb.SimulationError, match="cart and pole"):
        sim.step(steps=100)


SPINNING = {
    "planar": (True, ["A.angle", "b.angle"]),
    "spatial": (False, ["A.angle", "b.yaw"]),
}


@pytest.mark.parametrize("name", SPINNING)
@pytest.mark.parametrize("method", ["joint", "absolute", "impulse", "driven"])
def test_outputs_count_whole_turns(name, method):
    """Angles of joints and bodies at many turns a step, from a start of several turns, whatever else reads them."""
    planar, outputs = SPINNING[name]
    inertia = 0.1 if planar else (0.1, 0.1, 0.1)
    axis = {} if planar else {"axis": (0, 0, 1)}
    m = fb.Mechanism("wheel", planar=planar)
    m.add(fb.Body("b", mass=1, inertia=inertia), fb.Revolute("A", "ground", "b", at=(0,) * (2 + (not planar)), **axis))
    if method == "driven":
        m.add(fb.Driver("d", "A.angle", "20 + 300*t"))
    options = {"method": "impulse"} if method == "impulse" else {"coordinates": method} if method != "driven" else {}
    sim = m.stepper(0.05, outputs=outputs, t_start=1.0 if method != "driven" else 0.0, **options)
    start = 20.0
    if method != "driven":
        sim.reset({"A.angle": (20.0, 300.0)})
    assert sim.outputs()[0] == pytest.approx(start)
    assert np.unwrap([0.0, sim.outputs()[1] - start])[1] == pytest.approx(0.0, abs=1e-9)  # the same but for turns
    y = np.array([sim.outputs(), *(sim.step() for _ in range(10))])
    slow = 0.99 if method == "impulse" and not planar else 1.0  # steps of 1.5 rad of a joint in space
    assert y[-1, 0] - y[0, 0] == pytest.approx(150.0, rel=1.001 - slow + 1e-5)
    assert y[-1, 1] - y[0, 1] == pytest.approx(y[-1, 0] - y[0, 0], abs=1e-6)
    saved = sim.state
    later = sim.step()
    sim.state = saved
    assert np.array_equal(sim.step(), later)


def test_reset_of_described_values_and_quantities():
    m = cart_pole()
    m.add(fb.Initial("pin.angle", value=0.2, rate=1.0))
    sim = m.stepper(0.02, outputs=NAMES)
    assert sim.reset({"pin.angle": "30 deg"})[2:4] == pytest.approx([np.pi / 6, 1.0])  # with the described rate
    assert sim.reset({"pin.angle": (0.5, "2 rad/s"), "rail.displacement": (None, 1.0)})[1:4] == pytest.approx(
        [1, 0.5, 2]
    )
    assert sim.reset()[2:4] == pytest.approx([0.2, 1.0])
    for values, message in (
        ([1], "mapping"),
        ({"pin.angle": "x"}, "'x'"),
        ({"pin.angle": "1 kg"}, "kg"),
        ({"pin.angle": (None, None)}, "to a value, or to value and rate"),
        ({"pin.angle": (1, 2, 3)}, "to a value, or to value and rate"),
        ({"nail.angle": 1}, "nail"),
    ):
        with pytest.raises(fb.ModelError, match=message):
            sim.reset(values)


def test_states_belong_to_their_stepper():
    a, b = (cart_pole().stepper(0.02, outputs=NAMES) for _ in range(2))
    with pytest.raises(fb.ModelError, match="one that this stepper gave"):
        b.state = a.state


@pytest.mark.parametrize("what", ["gravity", "shape", "initial", "nothing", "formula"])
def test_inputs_that_would_do_nothing_are_refused(what):
    gravity = (0, "-9.81*x") if what == "gravity" else (0, -9.81)
    m = fb.Mechanism(
        "p", planar=True, gravity=gravity, parameters={"x": 1.0} | ({"y": "2*x"} if what == "formula" else {})
    )
    shape = fb.Box(edges=("0.2*x", 0.1, 0.1)) if what == "shape" else None
    own = {"shape": shape, "density": 1000} if shape else {"mass": 1, "inertia": 0.02}
    m.add(fb.Body("b", position=(0.3, 0), **own), fb.Revolute("A", "ground", "b", at=(0, 0)))
    if what == "initial":
        m.add(fb.Initial("A.angle", value="x"))
    if what == "formula":
        m.add(fb.Motor("motor", "A", torque="y"))
    message = {
        "nothing": "no law reads it",
        "initial": "an initial value",
        "formula": "the parameter 'y' depends on it",
    }
    with pytest.raises(fb.ModelError, match=f"'x' cannot be an input of a stepper: .*{message.get(what, '')}"):
        m.stepper(0.01, inputs=["x"])


def test_time_stays_where_a_step_failed():
    sim = cart_pole("1/(0.01 - value)").stepper(0.05)
    for _ in range(3):
        with pytest.raises(fb.SimulationError):
            sim.step(steps=100)
        assert sim.t == 0.0
    assert sim.reset().shape == (0,)


def test_bad_inputs_are_refused():
    sim = cart_pole().stepper(0.02, inputs=["push"])
    for u in (["a"], {"push": 1}, [1j]):
        with pytest.raises(fb.ModelError, match="numbers in SI units"):
            sim.step(u)


@pytest.mark.parametrize("threads", [1, 2])
def test_one_copy_that_fails_does_not_stop_the_others(threads):
    sim = cart_pole("1/(0.01 - value)").stepper(0.05, outputs=NAMES, copies=3, threads=threads)
    for k, x in enumerate((-5.0, 0.0, -4.0)):
        sim.reset({"rail.displacement": x}, copy=k)
    with pytest.raises(fb.SimulationError, match=r"copy 1: .*cart and pole"):
        sim.step(steps=40)
    assert sim.t.tolist() == pytest.approx([2.0, 0.0, 2.0])


def test_several_steps_at_once_are_the_same_steps():
    """Also where turns of angles are counted from step to step."""
    m = fb.Mechanism("wheel", planar=True)
    m.add(fb.Body("b", mass=1, inertia=0.1), fb.Revolute("A", "ground", "b", at=(0, 0)), fb.Motor("M", "A", torque="0"))
    sims = [m.stepper(0.05, inputs=["M"], outputs=["A.angle"], coordinates="absolute") for _ in range(2)]
    for u in (20.0, -30.0, 5.0):
        for _ in range(10):
            one = sims[0].step([u])
        assert np.allclose(sims[1].step([u], steps=10), one, rtol=0, atol=1e-9)
