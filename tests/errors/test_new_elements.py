"""Bad input for couplings, the newer joints and forces, sensors and tables: the message names element, value and rule.

Every case is given twice, from Python and from a model file; the file's message also says where.
"""

import math

import pytest

import flyball as fb
from flyball.model.model_files import _value, dumps, loads

Z = (0, 0, 1)
SQUARE = [(1, 0), (0, 1), (-1, 0), (0, -1)]
NAN = math.nan


def plane() -> fb.Mechanism:
    m = fb.Mechanism("plane", planar=True, gravity=(0, -9.81), parameters={"r": 0.1})
    for name, x in (("arm", 0.5), ("cart", 2), ("wheel", 1)):
        m.add(fb.Body(name, mass=1, inertia=1, position=(x, 0)))
    m.add(fb.Frame("eye", "arm", position=(0.1, 0)))
    m.add(fb.Revolute("A", "ground", "arm", at=(0, 0)), fb.Revolute("W", "arm", "wheel", at=(1, 0)))
    m.add(fb.Translational("S", "ground", "cart", at=(2, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "arm", "cart", at=((0.5, 0), (2, 0)), stiffness=10))
    return m


def space() -> fb.Mechanism:
    m = fb.Mechanism("space", gravity=(0, 0, -9.81), parameters={"r": 0.1})
    for k, name in enumerate(("a", "b", "c", "d")):
        m.add(fb.Body(name, mass=1, inertia=(1, 1, 1), position=(k, 0, 1)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0, 0), axis=Z), fb.Revolute("D", "c", "d", at=(0, 0, 0), axis=Z))
    m.add(fb.Prismatic("P", "ground", "b", at=(1, 0, 0), axis=(1, 0, 0)), fb.Spherical("ball", "b", "c", at=(0, 0, 0)))
    return m


AT3 = {"body_i": "ground", "body_j": "a", "at": (0, 0, 1)}
AT2 = {"body_i": "arm", "body_j": "cart", "at": (2, 0)}

PLANAR = {
    # couplings: what they name
    "GearPair unknown joint": ({"joint_1": "A", "joint_2": "w"}, "no joint named 'w'.*mean 'W'.*known: A, W, S"),
    "GearPair of a slide": ({"joint_1": "A", "joint_2": "S"}, "Translational 'S' has no coordinate 'angle'; it has"),
    "GearPair of a force": ({"joint_1": "A", "joint_2": "spring"}, "no joint named 'spring'.*known: A, W, S"),
    "GearPair of a body": ({"joint_1": "A", "joint_2": "arm"}, "'arm' is a Body, no joint"),
    "GearPair with itself": ({"joint_1": "A", "joint_2": "A"}, "both its joints are 'A'; name two"),
    "RackAndPinion swapped": ({"rack": "A", "pinion": "S", "radius": 1}, "Revolute 'A' has no coordinate 'displ"),
    "RackAndPinion unknown": ({"rack": "SS", "pinion": "A", "radius": 1}, "no joint named 'SS'.*mean 'S'"),
    "Coupler of a force": ({"coordinates": ["A.angle", "spring.length"]}, "no joint named 'spring'.*known: A, W, S"),
    "Coupler misspelt": ({"coordinates": ["A.angel", "W.angle"]}, "no coordinate 'angel'.*mean 'angle'"),
    "Coupler without a dot": ({"coordinates": ["A", "W.angle"]}, "'A' is no coordinate; write joint.coordinate"),
    "Coupler twice the same": ({"coordinates": ["A.angle", "A.angle"]}, "names 'A.angle' twice; name it once"),
    "Coupler of one": ({"coordinates": ["A.angle"], "weights": [1]}, "couples 1 coordinate; give two or more"),
    "Coupler of a text": ({"coordinates": "A.angle"}, "'coordinates' must be a list, got 'A.angle'"),
    # their numbers
    "GearPair no teeth": ({"joint_1": "A", "joint_2": "W", "teeth": (10, 0)}, r"greater than 0, got \(10.0, 0.0\)"),
    "GearPair one tooth": ({"joint_1": "A", "joint_2": "W", "teeth": (10,)}, "teeth are two numbers"),
    "GearPair text": ({"joint_1": "A", "joint_2": "W", "teeth": ("ten", 20)}, "teeth of.*unknown name 'ten'"),
    "GearPair a number": ({"joint_1": "A", "joint_2": "W", "teeth": 10}, "'teeth' must be a list, got 10"),
    "GearPair units": ({"joint_1": "A", "joint_2": "W", "teeth": ("1 kg", 2)}, "teeth of.*'1 kg': expected a plain"),
    "GearPair field": ({"joint_1": "A", "joint_2": "W", "inside": True}, "unknown field 'inside'; its fields are"),
    "RackAndPinion radius": ({"rack": "S", "pinion": "A", "radius": 0}, "radius is 0 m; give the rolling radius"),
    "RackAndPinion unit": ({"rack": "S", "pinion": "A", "radius": "3 kg"}, "radius of.*'3 kg': expected a length"),
    "RackAndPinion bare": ({"rack": "S", "pinion": "A"}, "field 'radius' is missing"),
    "Coupler weights": ({"coordinates": ["A.angle", "W.angle"], "weights": [1]}, "as many weights, got 1"),
    "Coupler zero": ({"coordinates": ["A.angle", "W.angle"], "weights": [1, 0]}, "a weight is 0, which couples"),
    "Coupler nan": ({"coordinates": ["A.angle", "W.angle"], "weights": [1, NAN]}, "nan, a finite number is wanted"),
    "Coupler value": ({"coordinates": ["A.angle", "W.angle"], "value": "3 kg"}, "value of.*'3 kg': expected"),
    # joints
    "WheelOnLine flat": ({**AT2, "axis": (1, 0), "centre": (3, 0)}, "centre lies on the line; the wheel has no rad"),
    "WheelOnLine off": (
        {**AT2, "axis": (1, 0), "centre": (2.5, 1)},
        "perpendicular to the line; the centre is 0.5 m fur",
    ),
    "WheelOnLine bare": ({**AT2, "axis": (1, 0)}, "field 'centre' is missing"),
    "WheelOnLine axis": ({**AT2, "centre": (2, 1)}, r"give its axis in world coordinates.*axis=\(1, 0\)"),
    "KnifeEdge axis": (AT2, r"give its axis in world coordinates, for instance axis=\(1, 0\)"),
    "Cam of three": ({**AT2, "points": SQUARE[:3]}, "needs four points or more, each.*got 3"),
    "Cam repeated": ({**AT2, "points": [*SQUARE, (0, -1)]}, "points 3 and 4 of its profile coincide at.*leave one out"),
    "Cam closed": ({**AT2, "points": [*SQUARE, (1, 0)]}, "points 4 and 0 of its profile coincide"),
    "Cam roller": ({**AT2, "at": (0.1, 0), "points": SQUARE, "radius": 2}, "roller of 2 m does not fit.*smaller"),
    "Cam radius": ({**AT2, "points": SQUARE, "radius": -1}, "radius is -1 m; it must be zero or greater"),
    "Cam nan": ({**AT2, "points": [*SQUARE, (NAN, 0)]}, "points of Cam 'x': the value is nan"),
    "Cam text": ({**AT2, "points": "circle"}, "'points' must be a list, got 'circle'"),
    "Cam nowhere": ({"body_i": "arm", "body_j": "cart", "points": SQUARE}, "give its position: at="),
    "Screw in the plane": ({**AT2, "lead": 1}, "no meaning in a planar mechanism; use a joint of the plane"),
    "RollingDisk in the plane": ({**AT2, "radius": 1}, "no meaning in a planar mechanism"),
    "GeneralUniversal in the plane": (
        {**AT2, "at": ((0, 0), (1, 0)), "axes": (Z, (1, 0, 0))},
        "no meaning in a planar mechanism",
    ),
    "PointInPlane in the plane": ({**AT2, "axis": (1, 0)}, "no meaning in a planar mechanism"),
    "Revolute with an axis": ({**AT2, "axis": (1, 0)}, "its axis is the normal; leave axis out"),
    # ropes and bushings
    "Rope of one point": ({"bodies": ["arm"], "at": [(0, 0)]}, r"two ends at least, got bodies \('arm',\); name"),
    "Rope on one body": (
        {"bodies": ["arm", "arm"], "at": [(0, 0), (1, 0)]},
        "all its points are on 'arm'.*name another",
    ),
    "Rope by a frame": ({"bodies": ["eye", "arm"], "at": None}, "all its points are on 'arm'"),
    "Rope short of points": ({"bodies": ["arm", "cart"], "at": [(0, 0)]}, "2 bodies need as many points.*got 1"),
    "Rope coincident": ({"bodies": ["arm", "cart"], "at": [(1, 0), (1, 0)]}, "points 1 and 2 are both at.*direction"),
    "Rope unknown": ({"bodies": ["arm", "crat"], "at": None}, "no body or frame named 'crat'.*mean 'cart'"),
    "Rope of a joint": ({"bodies": ["arm", "A"], "at": None}, "'A' is a Revolute, no body or frame"),
    "Rope soft": (
        {"bodies": ["arm", "cart"], "stiffness": 0},
        "stiffness is 0 N/m; it must be greater than 0. Leave it out",
    ),
    "Rope bare": (
        {"bodies": ["arm", "cart"], "stiffness": None, "damping": 1},
        "damping is 1, and a rigid one has none",
    ),
    "Rope that bounces": ({"bodies": ["arm", "cart"], "restitution": 0.5}, "restitution belongs to a rigid one"),
    "Rope of text": ({"bodies": "arm"}, "'bodies' must be a list, got 'arm'"),
    "PathSpring of one point": ({"bodies": ["arm"], "at": [(0, 0)]}, r"two ends at least, got bodies \('arm',\); name"),
    "PathSpring loose": ({"bodies": ["arm", "cart"], "length": 1}, "length has no effect without stiffness"),
    "PathSpring negative": (
        {"bodies": ["arm", "cart"], "damping": -1},
        "damping is -1 N.s/m; it must be zero or greater",
    ),
    "Limit of a sum": ({"coordinate": ["A.angle", "W.angle"]}, "a sum of coordinates needs weights; give weights="),
    "Limit of a weight": ({"weights": [2]}, "weights are for a sum of coordinates; give a list of coordinates too"),
    "Brake of two": (
        {"coordinate": ["A.angle", "W.angle"], "weights": [1]},
        "2 coordinates need as many weights, got 1",
    ),
    "Actuator of twice": ({"coordinate": ["A.angle"] * 2, "weights": [1, 1], "force": 1}, "names 'A.angle' twice"),
    "Actuator of none": ({"coordinate": [], "weights": [], "force": 1}, "it names no coordinate"),
    "CoordinateSpring weight": ({"coordinate": ["A.angle", "W.angle"], "weights": [1, 0]}, "a weight is 0"),
    "CoordinateSpring weights": ({"coordinate": ["A.angle", "W.angle"], "weights": [1, "2 kg"]}, "weights of.*2 kg"),
    "CoordinateSpring unknown": ({"coordinate": ["A.angle", "V.angle"], "weights": [1, 1]}, "no joint named 'V'"),
    "Rope in space": ({"bodies": ["arm", "cart"], "at": [(0, 0, 1), (1, 0)]}, "planar, its third component must be 0"),
    "Bushing negative": ({**AT2, "stiffness": -1}, r"stiffness is one number or one for each axis, none negative"),
    "Bushing of three": ({**AT2, "stiffness": (1, 2, 3)}, r"stiffness is one number or 2 here.*got \(1.0, 2.0, 3.0\)"),
    "Bushing turned": ({**AT2, "orientation": (1, 0, 0, 0)}, "in a planar mechanism give angle=, not orientation="),
    "Bushing on itself": ({**AT2, "body_j": "eye"}, "both its ends are on 'arm'; it must join two different bodies"),
    # what is one-sided
    "Limit of nothing": ({"lower": None}, "it stops nothing; give lower=..., upper=... or both"),
    "Limit swapped": ({"upper": -1}, "lower is 0 rad; it must not be greater than upper, -1 rad"),
    "Limit unit": ({"lower": "1 mm"}, "lower of.*'1 mm': expected an angle"),
    "Limit restitution": ({"restitution": -0.1}, "restitution is -0.1; it must be zero or greater"),
    "Limit soft": ({"stiffness": 0}, "stiffness is 0; it must be greater than 0. Leave it out for a rigid one"),
    "Limit stiffness": ({"stiffness": "3 N/m"}, "stiffness of.*'3 N/m': expected a"),
    "Limit both": ({"stiffness": 10, "restitution": 0.5}, "restitution belongs to a rigid one and stiffness"),
    "Limit damped": ({"damping": 2}, "damping is 2, and a rigid one has none"),
    "Limit of a link": ({"coordinate": "A.displacement"}, "Revolute 'A' has no coordinate 'displacement'"),
    "Backlash gap": ({"gap": 0}, "gap is 0; it must be greater than 0. Without any play it is a Coupler"),
    "Backlash negative": ({"gap": -0.1}, "gap is -0.1; it must be greater than 0"),
    "Backlash unit": ({"gap": "1 mm"}, "gap of.*'1 mm': expected an angle"),
    "Backlash weights": ({"weights": [1]}, "2 coordinates need as many weights, got 1"),
    "Backlash zero": ({"weights": [1, 0]}, "a weight is 0, which couples nothing"),
    "Backlash weight": ({"weights": ["1 kg", 1]}, "weights of.*'1 kg': expected"),
    "Backlash twice": ({"coordinates": ["A.angle", "A.angle"]}, "it names 'A.angle' twice"),
    "Backlash of none": ({"coordinates": []}, "it names no coordinates; give one or more"),
    "Backlash unknown": ({"coordinates": ["A.angle", "V.angle"]}, "no joint named 'V'"),
    "OneWay direction": ({"direction": 2}, "direction is 2.*must be 1 .* or -1"),
    "OneWay itself": ({"relative_to": "A.angle"}, "'A.angle' relative to itself never moves"),
    "OneWay mixed": ({"relative_to": "S.displacement"}, "'A.angle' is in rad and 'S.displacement' in m"),
    "OneWay unknown": ({"relative_to": "B.angle"}, "no joint named 'B'"),
    "Ratchet bare": ({"pitch": None}, "give pitch= or teeth=, one of them"),
    "Ratchet both": ({"teeth": 12}, "give pitch= or teeth=, one of them"),
    "Ratchet negative": ({"pitch": -0.1}, "pitch is -0.1; it must be greater than 0"),
    "Ratchet teeth": ({"pitch": None, "teeth": 12.5}, "teeth is 12.5; a wheel has a whole number of them"),
    "Ratchet no teeth": ({"pitch": None, "teeth": -3}, "teeth is -3; it must be greater than 0"),
    "Ratchet straight": ({"coordinate": "S.displacement", "pitch": None, "teeth": 12}, "does not turn; give pitch="),
    "Ratchet unit": ({"pitch": "1 mm"}, "pitch of.*'1 mm': expected an angle"),
    "Detent pitch": ({"pitch": 0}, "pitch is 0; it must be greater than 0"),
    "Detent bare": ({"holding": None}, "give holding= or barrier=, one of them"),
    "Detent both": ({"barrier": 1}, "give holding= or barrier=, one of them"),
    "Detent unit": ({"holding": "1 N"}, "holding of.*'1 N': expected a torque"),
    # friction
    "JointFriction bearing": (
        {"joint": "A"},
        "the angle of Revolute 'A' needs the radius of the bearing; give radius=",
    ),
    "JointFriction angle": ({"joint": "A", "coordinate": "angle"}, "needs the radius of the bearing; give radius="),
    "JointFriction slide": ({"joint": "S", "radius": 0.1}, "Translational 'S' has no coordinate 'angle'; it has dis"),
    "JointFriction unknown": ({"joint": "AA", "radius": 0.1}, "no joint named 'AA'.*mean 'A'"),
    "JointFriction of a body": ({"joint": "arm", "radius": 0.1}, "'arm' is a Body, no joint"),
    "JointFriction of a force": ({"joint": "spring", "radius": 0.1}, "'spring' is a SpringDamper, no joint"),
    "JointFriction swapped": (
        {"joint": "S", "kinetic": 0.2},
        "kinetic friction 0.2 is greater than static friction 0.1",
    ),
    "JointFriction negative": ({"joint": "S", "static": -0.1}, "static is -0.1; it must be zero or greater"),
    "JointFriction unit": ({"joint": "S", "static": "0.1 N"}, "'0.1 N': expected a plain number"),
    "JointFriction viscous": ({"joint": "S", "viscous": "1 N*m*s/rad"}, "viscous of.*expected a damping"),
    "JointFriction rest": ({"joint": "S", "stick_speed": 0}, "stick_speed is 0 m/s.*greater than 0. Leave it out"),
    "Brake negative": ({"capacity": -2}, r"capacity of Brake 'x' is -2 N\*m; it must be zero or greater"),
    "Brake of a formula": ({"capacity": "3 - 5"}, r"capacity of Brake 'x' is -2 N\*m; it must be zero or greater"),
    "Brake unit": ({"capacity": "2 N"}, "capacity of.*'2 N': expected a torque"),
    "Brake bare": ({"capacity": None}, "field 'capacity' is missing"),
    "Brake weak": ({"static": 0.9}, "static is 0.9; it must be 1 or greater: the ratio of the largest torque"),
    "Brake misspelt": ({"coordinate": "A.angel"}, "no coordinate 'angel'.*mean 'angle'"),
    "Brake unknown name": ({"capacity": "2*pressure"}, "unknown name 'pressure'"),
    "Clutch negative": ({"capacity": -2}, r"capacity of Clutch 'x' is -2 N\*m; it must be zero or greater"),
    "Clutch weak": ({"static": 0}, "static is 0; it must be 1 or greater: the ratio of the largest torque"),
    "Clutch of one": ({"coordinate_j": "A.angle"}, "both its coordinates are 'A.angle'; name two"),
    "Clutch of two kinds": (
        {"coordinate_j": "S.displacement"},
        "'A.angle' is in rad and 'S.displacement' in m; a clutch needs two angles or two displacements",
    ),
    "Clutch unknown": ({"coordinate_i": "B.angle"}, "no joint named 'B'"),
    "JointFriction lengths": ({"joint": "S", "bending_length": 0}, "bending_length is 0 m; it must be greater than 0"),
    # along coordinates
    "CoordinateSpring misspelt": ({"coordinate": "S.displacment"}, "'displacment'.*mean 'displacement'"),
    "CoordinateSpring negative": ({"coordinate": "cart.x", "stiffness": -1}, "stiffness is -1; it must be zero or gr"),
    "CoordinateSpring unit": ({"coordinate": "S.displacement", "stiffness": "1 kg"}, "'1 kg': expected a stiffness"),
    "CoordinateSpring torsion": ({"coordinate": "A.angle", "stiffness": "1 N/m"}, "expected a torsional stiffness"),
    "CoordinateSpring rest": ({"coordinate": "A.angle", "stiffness": 1, "rest": "3 mm"}, "rest of.*expected an angle"),
    "CoordinateSpring of a force": ({"coordinate": "spring.length"}, "'spring' is a SpringDamper, no joint"),
    "Actuator name": (
        {"coordinate": "cart.x", "force": "foo*t"},
        "unknown name 'foo'(.|\n)*known names: r, rate, t, val",
    ),
    "Actuator unit": ({"coordinate": "S.displacement", "force": "3 N*m"}, "force of.*'3 N\\*m': expected a force"),
    "Actuator torque": ({"coordinate": "A.angle", "force": "3 N"}, "force of.*'3 N': expected a torque"),
    "Actuator nowhere": ({"force": 3}, "field 'coordinate' is missing"),
    "Actuator upwards": ({"coordinate": "cart.z", "force": 3}, "'cart' has the coordinates x, y, angle, not 'z'"),
    "Motor of a slide": ({"joint": "S", "torque": 3}, "Translational 'S' has no coordinate 'angle'"),
    "Motor of a body": ({"joint": "arm", "torque": 3}, "'arm' is a Body, no joint"),
    "PointForce of three": ({"body": "arm", "force": (1, 2, 3)}, "needs 2 components, such as"),
    "PointTorque of three": ({"body": "arm", "torque": (1, 2, 3)}, "torque: in a planar mechanism it is one number"),
    # sensors
    "Sensor unknown": ({"of": "B.angle"}, "'B.angle' is no curve of a part.*no part named 'B'.*known: arm, cart"),
    "Sensor without a curve": ({"of": "A"}, "'A' is no curve; Revolute 'A' has A.angle, A.rate, A.fx"),
    "Sensor misspelt": ({"of": "A.angel"}, "'A.angel' is no curve.*mean 'angle'"),
    "Sensor of energy": ({"of": "energy.kinetik"}, "energy has energy.kinetic.*mean 'kinetic'"),
    "Sensor as parameter": ({"of": "A.angle", "name": "r"}, "the name 'r' is a parameter's"),
    "IMU unknown": ({"frame": "eyes"}, "no body or frame named 'eyes'.*mean 'eye'"),
    "IMU of a joint": ({"frame": "A"}, "'A' is a Revolute, no body or frame"),
    "IMU on ground": ({"frame": "ground"}, "it is fixed on ground, which never moves; name a body"),
    "IMU bare": ({}, "field 'frame' is missing"),
    # tables
    "Table of one": ({"x": [0], "y": [0]}, "1 point makes no curve; give two points or more"),
    "Table lengths": ({"x": [0, 1], "y": [0]}, "x has 2 numbers and y has 1; give pairs"),
    "Table order": ({"x": [0, 1, 1], "y": [0, 1, 2]}, r"x\[2\] = 1 comes after x\[1\] = 1; x must ascend: sort"),
    "Table nan": ({"x": [0, 1], "y": [0, NAN]}, r"y\[1\] is nan; give a finite number, or leave the point out"),
    "Table name": ({"x": [0, 1], "y": [0, 1], "name": "my lift"}, "use letters, digits and _ only"),
    "Table sin": ({"x": [0, 1], "y": [0, 1], "name": "sin"}, "has a meaning in expressions; call it 'sin_curve'"),
    "Table as parameter": ({"x": [0, 1], "y": [0, 1], "name": "r"}, "the name 'r' is a parameter's"),
    "Table period": ({"x": [0, 1], "y": [0, 1], "beyond": "repeat"}, "a table that repeats ends where it starts"),
    "Table kind": ({"x": [0, 1], "y": [0, 1], "interpolation": "spline"}, "'cubic', 'monotone' or 'linear'.*'spline'"),
    "Table beyond": ({"x": [0, 1], "y": [0, 1], "beyond": "zero"}, "'refuse', 'hold', 'line' or 'repeat'.*'zero'"),
    "Table unit": ({"x": [0, 1], "y": [0, 1], "x_unit": "furlongg"}, "x_unit: .*unknown unit 'furlongg'"),
    "Table text": ({"x": [0, "1 mm"], "y": [0, 1]}, "field 'x' must be a number"),
    # drivers
    "Driver of a table unknown": ({"coordinate": "A.angle", "law": "lift(t)"}, "unknown function 'lift'"),
    "Driver of a force": ({"coordinate": "spring.length", "law": "t"}, "'spring' is a SpringDamper, no joint"),
}
WHEEL = {**AT3, "axis": (0, 1, 0), "radius": 0.46, "conicity": 0.05}
SPATIAL = {
    "GearPair without a carrier": (
        {"joint_1": "A", "joint_2": "D"},
        r"'A' \(a - ground\) and 'D' \(c - d\) have no body in common; both gears must turn on one carrier",
    ),
    "Screw lead": ({**AT3, "axis": Z, "lead": 0}, "lead is 0 m; without one it is a Revolute"),
    "Screw bare": ({**AT3, "axis": Z}, "field 'lead' is missing"),
    "Screw unit": ({**AT3, "axis": Z, "lead": "5 deg"}, "lead of.*'5 deg': expected a length"),
    "Screw axis": ({**AT3, "lead": 1}, r"give its axis in world coordinates, for instance axis=\(0, 0, 1\)"),
    "Screw no axis": ({**AT3, "axis": (0, 0, 0), "lead": 1}, "has no length; a direction must not be zero"),
    "GeneralUniversal parallel": ({**AT3, "at": ((0, 0, 0), (0, 0, 1)), "axes": (Z, Z)}, "axes are parallel; a link"),
    "GeneralUniversal axes": ({**AT3, "at": ((0, 0, 0), (0, 0, 1))}, "give its two axes, for instance axes="),
    "GeneralUniversal one point": ({**AT3, "axes": (Z, (1, 0, 0))}, r"'at' must be a list of 2, got .0, 0, 1"),
    "KnifeEdge along": (
        {**AT3, "axis": Z, "normal": (0, 0, 2)},
        "its normal is parallel to its edge; give the direction",
    ),
    "KnifeEdge bare": (AT3, "give its axis in world coordinates"),
    "RollingDisk flat": ({**AT3, "axis": Z, "radius": 1}, "the wheel lies flat and cannot roll; turn its axis"),
    "RollingDisk radius": (
        {**AT3, "axis": (1, 0, 0), "radius": -1},
        "radius is -1 m; it must be greater than 0. For a",
    ),
    "RollingDisk tread": ({**AT3, "axis": (1, 0, 0), "radius": 1, "tread": -1}, "tread is -1 m; it must be zero or"),
    "RollingDisk bare": ({**AT3, "axis": (1, 0, 0)}, "field 'radius' is missing"),
    "RollingBall radius": ({**AT3, "radius": "0 mm"}, "radius is 0 m; it must be greater than 0"),
    "RollingBall unit": ({**AT3, "radius": "1 s"}, "radius of.*'1 s': expected a length"),
    "RollingBall nowhere": ({"body_i": "ground", "body_j": "a", "radius": 1}, "give its position: at="),
    "WheelOnLine in space": (
        {**AT3, "axis": (1, 0, 0), "centre": Z},
        "for planar mechanisms; in space use RollingDisk",
    ),
    "PinInSlot in space": ({**AT3, "axis": Z}, "for planar mechanisms; in space use PointOnLine"),
    "Cam of three numbers": ({**AT3, "axis": Z, "points": [(*p, 0) for p in SQUARE]}, r"each \(x, y\)"),
    "Cam axis": ({**AT3, "points": SQUARE}, "give its axis in world coordinates"),
    "Bushing of two": ({**AT3, "stiffness": (1, 2)}, r"stiffness is one number or 3 here.*got \(1.0, 2.0\)"),
    "Bushing of four": ({**AT3, "stiffness": (1, 2, 3, 4)}, "one number or one for each axis"),
    "Bushing unit": ({**AT3, "stiffness": "3 N"}, "stiffness of.*'3 N': expected a stiffness"),
    "Bushing angle": ({**AT3, "angle": 1}, "in a spatial mechanism give orientation=, not angle="),
    "Bushing nowhere": ({"body_i": "ground", "body_j": "a"}, "give its position: at="),
    "JointFriction of a ball": ({"joint": "ball", "radius": 0.1}, "Spherical 'ball' has no coordinate 'angle'"),
    "WheelOnRail bare": ({**WHEEL, "conicity": None}, "the wheel has no profile; give conicity= or wheel_profile="),
    "WheelOnRail twice": ({**WHEEL, "wheel_profile": SQUARE}, "both conicity and wheel_profile are given"),
    "WheelOnRail crossing": (
        {**WHEEL, "conicity": None, "wheel_profile": [(0, 0), (0.01, 0), (0.03, 0.01), (0.02, 0.02)]},
        r"wheel_profile: y = 0.02 m of point 3 comes after 0.03 m; y must ascend: .* turns back or crosses itself",
    ),
    "WheelOnRail short": ({**WHEEL, "rail_profile": [(0, 0), (0.01, 0), (0.02, 0)]}, "has 3 points; give four or more"),
    "WheelOnRail pairs": ({**WHEEL, "rail_profile": [(0, 0, 0)]}, r"give pairs of numbers, such as \(y, z\)"),
    "WheelOnRail arcs": ({**WHEEL, "rail_arcs": [(0.3, 0.01), (0.08, 0.005)]}, "arc 1 has the radius .* ends ascend"),
    "WheelOnRail vertical": ({**WHEEL, "rail_arcs": [(0.01, 0.02)]}, "is vertical before it ends at y = 0.02 m"),
    "WheelOnRail askew": ({**WHEEL, "direction": (0, 1, 1)}, "is not perpendicular to axis"),
    "WheelOnRail smooth": ({**WHEEL, "friction": 0}, "friction is 0; give a small one"),
    "WheelOnRail Poisson": ({**WHEEL, "poissons_ratio": 0.6}, "poissons_ratio is 0.6; it is from 0 to 0.5"),
    "WheelOnRail curve": ({**WHEEL, "curve_radius": 300, "roller_radius": 1}, "curve_radius is that of a track"),
    "WheelOnRail rough roller": (
        {**WHEEL, "vertical": "t", "roller_radius": 1},
        "functions of the distance along a track",
    ),
    "WheelOnRail radius": ({**WHEEL, "radius": 0}, "radius is 0 m; it must be greater than 0"),
    "WheelOnRail nowhere": ({**WHEEL, "at": None}, "give at=, the place on top of the rail|give its position: at="),
    "PointForce of two": ({"body": "a", "force": (1, 2)}, "needs 3 components, such as"),
    "PointTorque of one": ({"body": "a", "torque": 1}, "needs 3 components, such as"),
    "Sensor of a freedom": ({"of": "P.angle"}, "'P.angle' is no curve; Prismatic 'P' has P.displacement, P.rate"),
}
NEEDED = {
    "GearPair": {"teeth": (10, 20)},
    "Coupler": {"weights": [1, -1]},
    "JointFriction": {"static": 0.1},
    "Limit": {"coordinate": "A.angle", "lower": 0},
    "Backlash": {"coordinates": ["A.angle", "W.angle"], "gap": 0.1},
    "OneWay": {"coordinate": "A.angle"},
    "Ratchet": {"coordinate": "A.angle", "pitch": 0.1},
    "Detent": {"coordinate": "A.angle", "pitch": 0.1, "holding": 1},
    "Rope": {"stiffness": 1, "at": [(0, 0), (1, 0)]},
    "Brake": {"coordinate": "A.angle", "capacity": 1},
    "Clutch": {"coordinate_i": "A.angle", "coordinate_j": "W.angle", "capacity": 1},
}
CATEGORY = {"Sensor": "sensors", "IMU": "sensors", "Table": "tables", "Driver": "drivers"}
CASES = [(plane, k, *v) for k, v in PLANAR.items()] + [(space, k, *v) for k, v in SPATIAL.items()]


def fields_of(case: str, given: dict) -> tuple[str, dict]:
    """Class and fields; what is not said of a class that needs it is sound, and None leaves it out."""
    kind = case.partition(" ")[0]
    fields = {"name": "x"} | NEEDED.get(kind, {}) | given
    return kind, {k: v for k, v in fields.items() if v is not None}


@pytest.mark.parametrize(("model", "case", "given", "message"), CASES, ids=[f"{c[0].__name__}-{c[1]}" for c in CASES])
def test_it_is_refused_and_said_why(model, case, given, message):
    kind, fields = fields_of(case, given)
    m = model()
    with pytest.raises(fb.ModelError, match=message) as error:
        m.add(getattr(fb, kind)(**fields))
    assert f"{kind} {fields['name']!r}" in str(error.value)
    assert "x" not in m.by_name


@pytest.mark.parametrize(("model", "case", "given", "message"), CASES, ids=[f"{c[0].__name__}-{c[1]}" for c in CASES])
def test_a_file_is_refused_and_said_where(model, case, given, message):
    kind, fields = fields_of(case, given)
    category = CATEGORY.get(kind) or getattr(fb, kind).category
    lines = [f"[[{category}]]", *([f'type = "{kind}"'] if kind not in ("Sensor", "Table", "Driver") else [])]
    text = "\n".join([dumps(model()), *lines, *(f"{k} = {_value(v)}" for k, v in fields.items())])
    with pytest.raises(fb.ModelError, match=message) as error:
        loads(text, fb.Mechanism, "bad.toml")
    assert str(error.value).startswith(f"bad.toml: [[{category}]]")
    assert repr(fields["name"]) in str(error.value)
