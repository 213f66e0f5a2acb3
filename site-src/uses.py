"""A line of use for each class that describes something, and signs and axes of some; for the reference."""

USES = {
    # bodies, frames, drivers, sensors
    "Bodies": 'fb.Bodies("balls", shape=fb.Sphere(radius=0.01), density=2500, position=[(0, 0, 1), (0.1, 0, 1)])',
    "Body": 'fb.Body("crank", mass=0.4, inertia=0.0015, position=(0, 0.1))',
    "Driver": 'fb.Driver("motor", "A.angle", "speed*t")',
    "Frame": 'fb.Frame("tip", "coupler", position=(0.05, 0.2))',
    "Ground": 'fb.Ground("floor", shape=fb.Plane())',
    "IMU": 'fb.IMU("imu", "crank")',
    "Initial": 'fb.Initial("A.angle", value="30 deg", rate=0)',
    "Sensor": 'fb.Sensor("height", "tip.y")',
    "Table2D": 'fb.Table2D("torque", x=(0, 100, 200), y=(0, 1), z=[(0, 50), (0, 60), (0, 40)], interpolation="linear")',
    "Table": 'fb.Table("profile", x=(0, 0.5, 1), y=(0, 1, 0), interpolation="cubic")',
    # joints, couplings
    "Cam": 'fb.Cam("contact", "cam", "follower", points=[(0.1, 0), (0, 0.12), (-0.1, 0), (0, -0.1)], at=(0, 0.12))',
    "Constraint": 'fb.Constraint("cam", "slide.displacement - 0.02*(1 - cos(A.angle))")',
    "Coupler": 'fb.Coupler("equal", ("A.angle", "D.angle"), weights=(1, -1))',
    "Cylindrical": 'fb.Cylindrical("B", "crank", "coupler", at=(0, 0, 0), axis=(0, 0, 1))',
    "Distance": 'fb.Distance("link", "crank", "rocker", at=((0, 0.2), (0.5, 0.5)))',
    "Fixed": 'fb.Fixed("weld", "arm", "tool", at=(0.4, 0))',
    "FlatFacedCam": (
        'fb.FlatFacedCam("tappet", "cam", "follower", points=[(0.1, 0), (0, 0.12), (-0.1, 0), (0, -0.1)], '
        "at=(0, 0.12), normal=(0, 1))"
    ),
    "GearPair": 'fb.GearPair("mesh", "A", "B", teeth=(20, 60))',
    "GeneralUniversal": (
        'fb.GeneralUniversal("link", "shaft", "fork", at=((0, 0, 0), (0.1, 0, 0)), axes=((1, 0, 0), (0, 1, 0.2)))'
    ),
    "KnifeEdge": 'fb.KnifeEdge("skate", "ground", "sleigh", at=(0, 0), axis=(1, 0))',
    "LinearActuator": 'fb.LinearActuator("boom", "ground", "arm", at=((0, -1), (1, 0)), length="1.4 + 0.1*sin(t)")',
    "Orientation": 'fb.Orientation("parallel", "ground", "table", at=(0, 0))',
    "PinInSlot": 'fb.PinInSlot("slot", "lever", "block", at=(0, 0.3), axis=(0, 1))',
    "Planar": 'fb.Planar("table", "ground", "puck", at=(0, 0, 0), axis=(0, 0, 1))',
    "PointInPlane": 'fb.PointInPlane("rest", "ground", "foot", at=(0, 0, 0), axis=(0, 0, 1))',
    "RopeSpan": 'fb.RopeSpan("part", "drum", "load", at=((0, 0), (0.1, -2)), radii=(-0.1, 0))',
    "PointOnCurve": (
        'fb.PointOnCurve("wire", "ground", "bead", at=(0.4, 0, 0), formulas=("0.4*cos(u)", "0.4*sin(u)", "-0.02*u"), '
        "interval=(0, '8*pi'))"
    ),
    "PointOnLine": 'fb.PointOnLine("guide", "ground", "rod", at=(0.3, 0), axis=(1, 0))',
    "Prismatic": 'fb.Prismatic("slide", "ground", "cart", at=(0, 0), axis=(1, 0))',
    "RackAndPinion": 'fb.RackAndPinion("rack", "rack_slide", "pinion_hinge", radius=0.05)',
    "Revolute": 'fb.Revolute("A", "ground", "crank", at=(0, 0))',
    "RollingBall": 'fb.RollingBall("roll", "ground", "ball", at=(0, 0, 0.1), radius=0.1, normal=(0, 0, 1))',
    "RollingDisk": (
        'fb.RollingDisk("roll", "ground", "wheel", at=(0, 0, 0.3), radius=0.3, axis=(0, 1, 0), normal=(0, 0, 1))'
    ),
    "Screw": 'fb.Screw("thread", "ground", "nut", at=(0, 0, 0), axis=(0, 0, 1), lead="5 mm")',
    "Spherical": 'fb.Spherical("ball", "ground", "top", at=(0, 0, 0))',
    "Translational": 'fb.Translational("slide", "ground", "slider", at=(0.7, 0), axis=(1, 0))',
    "Universal": 'fb.Universal("hooke", "input", "output", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0)))',
    "WheelOnLine": 'fb.WheelOnLine("roll", "ground", "wheel", at=(0, 0), axis=(1, 0), centre=(0, 0.3))',
    # forces
    "Actuator": 'fb.Actuator("cylinder", "slide.displacement", force="200*(0.3 - value) - 20*rate")',
    "Brake": 'fb.Brake("brake", "A.angle", capacity="5 N*m")',
    "Bushing": 'fb.Bushing("mount", "ground", "arm", at=(0, 0, 0), stiffness=(1e6, 1e6, 1e5), damping=(1e3, 1e3, 1e2))',
    "Clutch": 'fb.Clutch("clutch", "A.angle", "B.angle", capacity="20 N*m")',
    "CoordinateSpring": 'fb.CoordinateSpring("spring", "A.angle", stiffness=50, damping=0.4, rest="10 deg")',
    "RotorInertia": 'fb.RotorInertia("rotor", "A.angle", inertia="40 g*cm^2", ratio=100)',
    "Detent": 'fb.Detent("notches", "A.angle", pitch="30 deg", holding="2 N*m")',
    "JointFriction": 'fb.JointFriction("bearing", "A", radius="20 mm", static=0.2, kinetic=0.15)',
    "Motor": 'fb.Motor("motor", "A", torque="2 - 0.1*rate")',
    "EngineMap": (
        'fb.EngineMap("engine", "A", speeds=(500, 1500, 2500), speed_unit="rpm", throttles=(0, 0.5, 1), '
        'torques=((-60, 300, 500), (-90, 400, 800), (-150, 250, 600)), throttle=0.7, idle="600 rpm")'
    ),
    "GearBox": (
        'fb.GearBox("box", "A.angle", "B.angle", ratios=(5.3, 2.5, 1.4, 1), capacity="1500 N*m", '
        'up="2200 rpm", down="900 rpm")'
    ),
    "Tyre": (
        'fb.Tyre("tyre", "ground", "a", at=(0, 0, 0.3), model=fb.LinearTyre(radius=0.3, stiffness=2e5, '
        "nominal_load=4e3, slip_stiffness=8e4, cornering_stiffness=6e4))"
    ),
    "LinearTyre": (
        "fb.LinearTyre(radius=0.3, stiffness=2e5, nominal_load=4e3, slip_stiffness=8e4, cornering_stiffness=6e4)"
    ),
    "FialaTyre": (
        "fb.FialaTyre(radius=0.3, stiffness=2e5, nominal_load=4e3, slip_stiffness=8e4, cornering_stiffness=6e4)"
    ),
    "MagicFormula": 'fb.MagicFormula(path="205_60R15.tir", coefficients={"LMUY": 0.8})',
    "Road": 'fb.Road("road", surface=fb.RandomRoad(roughness="C", length=200), friction=0.7)',
    "RoadProfile": "fb.RoadProfile(heights=[0, 0, 0.05, 0.1, 0.1], spacing=0.2)",
    "RandomRoad": 'fb.RandomRoad(roughness="B", length=200, track=1.6, seed=3)',
    "OpenCRG": 'fb.OpenCRG(path="belgian_block.crg")',
    "PathSpring": 'fb.PathSpring("tendon", ("forearm", "pulley", "finger"), stiffness="2e3 N/m", force="5*command")',
    "PointForce": 'fb.PointForce("push", "cart", force=(10, 0), at=(0, 0.1))',
    "PointTorque": 'fb.PointTorque("drive", "wheel", torque=5)',
    "Rope": 'fb.Rope("rope", ("ground", "load"), at=((0, 2), (0, 0)), stiffness="2e5 N/m", damping="200 N*s/m")',
    "Rubber": (
        'fb.Rubber("mount", "slide.displacement", stiffness="1e5 N/m", viscous_stiffness=("4e4 N/m",), '
        'relaxation_times=("10 ms",), friction="50 N", friction_travel="0.4 mm")'
    ),
    "SpringDamper": (
        'fb.SpringDamper("spring", "ground", "slider", at=((1.2, 0), (0.7, 0)), stiffness=200, damping=1, length=0.5)'
    ),
    "WheelOnRail": (
        'fb.WheelOnRail("left", "ground", "wheelset", at=(0, 0.75, 0), axis=(0, 1, 0), radius=0.46, conicity=0.05)'
    ),
    "TorsionalSpringDamper": 'fb.TorsionalSpringDamper("spring", "A", stiffness="20 N*m/rad", damping=0.1)',
    # stops
    "Backlash": 'fb.Backlash("teeth", ("A.angle", "B.angle"), weights=(20, 60), gap="2 deg")',
    "Limit": 'fb.Limit("stop", "A.angle", lower="-30 deg", upper="90 deg", restitution=0.2)',
    "OneWay": 'fb.OneWay("freewheel", "A.angle")',
    "Ratchet": 'fb.Ratchet("pawl", "A.angle", pitch="15 deg")',
    "ShearPin": 'fb.ShearPin("pin", "A.angle", strength="40 N*m")',
    # events
    "Event": 'fb.Event("open", "A.angle > 90 deg", do=[fb.Release("latch")])',
    "Impulse": 'fb.Impulse("ball", (0, "3 N*s"), at=(0.4, 0))',
    "Lock": 'fb.Lock("A")',
    "Note": 'fb.Note("half way")',
    "Release": 'fb.Release("latch")',
    "Set": 'fb.Set("k", "2*k")',
    "Stop": "fb.Stop()",
    # contact
    "Contact": "fb.Contact(friction=0.3, restitution=0.2)",
    "Material": 'fb.Material("rubber", friction=0.9, restitution=0.6)',
    "MaterialPair": 'fb.MaterialPair("rubber", "steel", friction=0.7)',
    "Stepping": 'm.simulate(2, method=fb.Stepping(step="1 ms"))',
    # controllers
    "ComputedTorque": 'fb.ComputedTorque("ct", coordinates=["A.angle"], reference=["sin(t)"], kp=100, kd=20)',
    "GravityCompensatedPD": 'fb.GravityCompensatedPD("pd", coordinates=["A.angle"], reference=["1"], kp=50, kd=10)',
    "Integrator": 'fb.Integrator("sum", of="0.2 - slide.displacement", gain=2)',
    "Lag": 'fb.Lag("valve", of="command", time="20 ms")',
    "SpeedDriver": 'fb.SpeedDriver("pedals", setpoint=20, measured="a.vx", kp=0.5, ki=0.1)',
    "PathDriver": (
        'fb.PathDriver("steers", "a", path=[(0, 0), (30, 0), (60, 3.5), (90, 3.5), (200, 3.5)], wheelbase=2.7)'
    ),
    "PID": 'fb.PID("pid", setpoint="0.2", measured="slide.displacement", kp=80, ki=60, kd=12, filter="20 ms")',
    "State": 'fb.State("heat", rate="power - 0.1*heat", initial=0)',
    "StateSpace": 'fb.StateSpace("law", inputs=["A.angle", "A.angle_rate"], D=[[-40, -6]], period="10 ms")',
    "Transfer": 'fb.Transfer("filter", of="A.angle", num=[1], den=[0.01, 1])',
    "FMU": 'fb.FMU("engine", "engine.fmu", inputs={"speed": "crank.rate"}, period="1 ms")',
    # shapes
    "Box": "fb.Box(edges=(0.3, 0.2, 0.1))",
    "Capsule": "fb.Capsule(radius=0.05, length=0.4)",
    "Cone": "fb.Cone(radius=0.1, height=0.2)",
    "Cylinder": "fb.Cylinder(radius=0.1, length=0.05)",
    "Ellipsoid": "fb.Ellipsoid(semi_axes=(0.3, 0.2, 0.1))",
    "HeightField": "fb.HeightField(heights=[[0, 0.1, 0], [0, 0.2, 0.1]], dx=0.5)",
    "Hemisphere": "fb.Hemisphere(radius=0.1)",
    "Hull": "fb.Hull(vertices=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])",
    "Link": "fb.Link(start=(0, 0, 0), end=(0.5, 0, 0), width=0.04, thickness=0.02)",
    "Mesh": 'fb.Mesh(path="part.stl", scale=0.001)',
    "Plane": "fb.Plane(normal=(0, 0, 1))",
    "Prism": "fb.Prism(outline=[(0, 0), (0.2, 0), (0, 0.1)], thickness=0.02)",
    "Rod": "fb.Rod(start=(0, 0, 0), end=(0.7, 0, 0), radius=0.02)",
    "Sphere": "fb.Sphere(radius=0.1)",
    "Torus": "fb.Torus(radius=0.3, tube_radius=0.05)",
    "Tube": "fb.Tube(radius=0.1, inner_radius=0.08, length=0.5)",
}
"""A line for each; the tests make the object of each."""

SIGNS = {
    "Revolute": "A positive angle turns `body_j` relative to `body_i` by the right hand about `axis`, in the plane "
    "counter-clockwise.",
    "Prismatic": "A positive displacement moves `body_j` relative to `body_i` along `axis`.",
    "Screw": "With a positive lead the thread is right-handed: a positive angle, by the right hand about `axis`, moves "
    "`body_j` along `axis` by `lead` per turn.",
    "Universal": "`axes[0]` is fixed on `body_i`, `axes[1]` on `body_j`. `angle_1` turns the cross, with `body_j`, "
    "about `axes[0]`, then `angle_2` turns `body_j` about `axes[1]`, both by the right hand.",
    "SpringDamper": "A positive tension pulls both points together: stiffness (distance - length) + damping times the "
    "rate of the distance.",
    "Motor": "A positive torque turns `body_j` in the sense of a positive angle, and `body_i` the other way.",
    "Actuator": "A positive force increases the coordinate.",
}
"""Signs and axes; verified in ``tests/program/test_uses.py``."""
