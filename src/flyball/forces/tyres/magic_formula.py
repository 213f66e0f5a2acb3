"""Magic Formula of Pacejka, versions 5.2 and 6.x, without turn slip.

Equations 4.E1 to 4.E78 of Pacejka, *Tire and Vehicle Dynamics* (3rd edition, 2012), in the axes of the files, which are
the W axes of ISO. Version 5.2 (the 1st edition, 2002; PAC2002) differs in the camber terms of the lateral force (PHY3
in place of PKY6 and PKY7) and of the trail, in the lateral force that makes the aligning moment, and in slip angles in
place of their tangents. The growth of the free radius (Q_RE0, Q_V1) changes the rolling radius only, not the load. The
deflections by longitudinal and lateral forces, bottoming, and the change of friction with speed
are left out. A wheel that runs backwards has the trail on the other side.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType, SimpleNamespace
from typing import Annotated, Any, ClassVar

from ...compiler.formulas import formula
from ...errors import ModelError
from ...math.scalar import absolute, atan, choose, cos, exp, integer_power, maximum, minimum, power, sign, sin, sqrt
from ...model.element import NamedNumbers, Number, Unit, element, positive
from ...model.expressions import number
from ...model.linked_files import FilePath, LinkedFile
from ...model.messages import suggest
from .tir_files import OTHER_NAMES, OWN_NAMES, RANGE_NAMES, RANGES, TyreData, completed, read_tir
from .tyre_model import LEAST_RELAXATION, RADIUS, STIFFNESS, TyreModel, damped_load, spin_direction

KIND = 2
(
    FNOMIN, LONGVL, BREFF, DREFF, FREFF, QV1, QV2, QRE0, QFZ1, QFZ2, QFZ3, PFZ1, CLONG, CLAT,
    LFZO, LCX, LMUX, LEX, LKX, LHX, LVX, LCY, LMUY, LEY, LKY, LHY, LVY, LKYC, LTR, LRES, LKZC, LXAL, LYKA, LVYKA, LS,
    LSGKP, LSGAL, LMX, LVMX, LMY, LGAX, LGAY, LGAZ,
    PCX1, PDX1, PDX2, PDX3, PEX1, PEX2, PEX3, PEX4, PKX1, PKX2, PKX3, PHX1, PHX2, PVX1, PVX2, PTX1, PTX2, PTX3,
    PPX1, PPX2, PPX3, PPX4, RBX1, RBX2, RBX3, RCX1, REX1, REX2, RHX1,
    PCY1, PDY1, PDY2, PDY3, PEY1, PEY2, PEY3, PEY4, PEY5, PKY1, PKY2, PKY3, PKY4, PKY5, PKY6, PKY7, PHY1, PHY2, PHY3,
    PVY1, PVY2, PVY3, PVY4, PTY1, PTY2, PPY1, PPY2, PPY3, PPY4, PPY5,
    RBY1, RBY2, RBY3, RBY4, RCY1, REY1, REY2, RHY1, RHY2, RVY1, RVY2, RVY3, RVY4, RVY5, RVY6,
    QBZ1, QBZ2, QBZ3, QBZ4, QBZ5, QBZ6, QBZ9, QBZ10, QCZ1, QDZ1, QDZ2, QDZ3, QDZ4, QDZ6, QDZ7, QDZ8, QDZ9, QDZ10, QDZ11,
    QEZ1, QEZ2, QEZ3, QEZ4, QEZ5, QHZ1, QHZ2, QHZ3, QHZ4, PPZ1, PPZ2, SSZ1, SSZ2, SSZ3, SSZ4,
    QSX1, QSX2, QSX3, QSX4, QSX5, QSX6, QSX7, QSX8, QSX9, QSX10, QSX11, PPMX1,
    QSY1, QSY2, QSY3, QSY4, QSY5, QSY6, QSY7, QSY8,
    PRESSURE, LEGACY,
) = range(3, 3 + len(OWN_NAMES) + 2)  # fmt: skip
"""Places of the numbers: those of `tir_files.OWN_NAMES`, in its order; relative inflation pressure, and 1 for version
5.2."""
SMALL = 1e-6  # of the nominal load: added to a peak or a stiffness that may be zero
DEGRESSIVE = 10.0  # A_mu of equation 4.E8
PEAK = 2.5  # slip, relative to peak over stiffness, beyond which the force has no use of more deflection
TWO_BY_PI = 0.6366197723675814


@formula
def reference(data, at, load):
    """Return nominal load, relative change of the load, and relative change of the pressure."""
    nominal = data[at + FNOMIN] * data[at + LFZO]
    return nominal, (load - nominal) / nominal, data[at + PRESSURE] - 1.0


@formula
def curve(stiffness, shape, peak, curvature, slip, small):
    """Return D sin(C atan(B x - E (B x - atan(B x)))) with B C D the stiffness; E is 1 at most."""
    b = stiffness / (shape * peak + small) * slip
    e = minimum(curvature, 0.0 * curvature + 1.0)
    return peak * sin(shape * atan(b - e * (b - atan(b))))


@formula
def cosine(b, c, e, x):
    """Return cos(C atan(B x - E (B x - atan(B x)))), E at most 1."""
    b = b * x
    e = minimum(e, 0.0 * e + 1.0)
    return cos(c * atan(b - e * (b - atan(b))))


@formula
def degressive(scale):
    """Return the scale factor of friction for what falls more slowly at low friction (4.E8)."""
    return DEGRESSIVE * scale / (1.0 + (DEGRESSIVE - 1.0) * scale)


@formula
def slip_stiffness(data, at, load):
    """Return the longitudinal slip stiffness (4.E15)."""
    _, df, dp = reference(data, at, load)
    pressure = 1.0 + dp * (data[at + PPX1] + data[at + PPX2] * dp)
    return load * (data[at + PKX1] + data[at + PKX2] * df) * exp(data[at + PKX3] * df) * pressure * data[at + LKX]


@formula
def cornering_stiffness(data, at, load, camber):
    """Return the cornering stiffness (4.E25), negative in the axes of the files."""
    nominal, _, dp = reference(data, at, load)
    peak = (data[at + PKY2] + data[at + PKY5] * camber * camber) * (1.0 + data[at + PPY2] * dp)
    scale = data[at + PKY1] * nominal * (1.0 + data[at + PPY1] * dp) * data[at + LKY]
    return scale * (1.0 - data[at + PKY3] * absolute(camber)) * sin(data[at + PKY4] * atan(load / (peak * nominal)))


@formula
def longitudinal(data, at, friction, slip, camber, load):
    """Return the longitudinal force of pure slip (4.E9 to 4.E18)."""
    nominal, df, dp = reference(data, at, load)
    scale = friction * data[at + LMUX]
    pressure = 1.0 + dp * (data[at + PPX3] + data[at + PPX4] * dp)
    mu = (data[at + PDX1] + data[at + PDX2] * df) * pressure * (1.0 - data[at + PDX3] * camber * camber) * scale
    x = slip + (data[at + PHX1] + data[at + PHX2] * df) * data[at + LHX]
    e = (data[at + PEX1] + df * (data[at + PEX2] + data[at + PEX3] * df)) * data[at + LEX]
    e = e * (1.0 - data[at + PEX4] * sign(x))
    shift = load * (data[at + PVX1] + data[at + PVX2] * df) * data[at + LVX] * degressive(scale)
    shape = data[at + PCX1] * data[at + LCX]
    return curve(slip_stiffness(data, at, load), shape, mu * load, e, x, SMALL * nominal) + shift


@formula
def lateral(data, at, friction, tangent, camber, load):
    """Return the lateral force of pure slip (4.E19 to 4.E30), its friction, B C, and the shifts SHy and SVy."""
    nominal, df, dp = reference(data, at, load)
    scale = friction * data[at + LMUY]
    pressure = 1.0 + dp * (data[at + PPY3] + data[at + PPY4] * dp)
    mu = (data[at + PDY1] + data[at + PDY2] * df) * pressure * (1.0 - data[at + PDY3] * camber * camber) * scale
    stiffness = cornering_stiffness(data, at, load, camber)
    gain = degressive(scale) * choose(data[at + LEGACY], 1.0, data[at + LKYC])
    leaning = load * (data[at + PVY3] + data[at + PVY4] * df) * camber * gain
    cambering = load * (data[at + PKY6] + data[at + PKY7] * df) * (1.0 + data[at + PPY5] * dp) * data[at + LKYC]
    turned = (cambering * camber - leaning) / (stiffness - SMALL * nominal)
    h = (data[at + PHY1] + data[at + PHY2] * df) * data[at + LHY]
    h = h + choose(data[at + LEGACY], data[at + PHY3] * camber, turned)
    v = load * (data[at + PVY1] + data[at + PVY2] * df) * data[at + LVY] * degressive(scale) + leaning
    x = tangent + h
    e = 1.0 + data[at + PEY5] * camber * camber - (data[at + PEY3] + data[at + PEY4] * camber) * sign(x)
    e = e * (data[at + PEY1] + data[at + PEY2] * df) * data[at + LEY]
    shape = data[at + PCY1] * data[at + LCY]
    force = curve(stiffness, shape, mu * load, e, x, SMALL * nominal) + v
    return force, mu, stiffness / (mu * load + SMALL * nominal), h, v


@formula
def longitudinal_weight(data, at, slip, tangent, camber, df):
    """Return by how much the slip angle reduces the longitudinal force (4.E50 to 4.E57)."""
    b = (data[at + RBX1] + data[at + RBX3] * camber * camber) * cos(atan(data[at + RBX2] * slip)) * data[at + LXAL]
    c, e, h = data[at + RCX1], data[at + REX1] + data[at + REX2] * df, data[at + RHX1]
    return cosine(b, c, e, tangent + h) / cosine(b, c, e, h)


@formula
def lateral_weight(data, at, slip, tangent, camber, df):
    """Return by how much the longitudinal slip reduces the lateral force (4.E59 to 4.E65)."""
    b = data[at + RBY1] + data[at + RBY4] * camber * camber
    b = b * cos(atan(data[at + RBY2] * (tangent - data[at + RBY3]))) * data[at + LYKA]
    c, e, h = data[at + RCY1], data[at + REY1] + data[at + REY2] * df, data[at + RHY1] + data[at + RHY2] * df
    return cosine(b, c, e, slip + h) / cosine(b, c, e, h)


@formula
def induced_lateral(data, at, mu, slip, tangent, camber, load, df):
    """Return the lateral force that longitudinal slip induces (4.E66, 4.E67)."""
    d = mu * load * (data[at + RVY1] + data[at + RVY2] * df + data[at + RVY3] * camber)
    d = d * cos(atan(data[at + RVY4] * tangent))
    return d * sin(data[at + RVY5] * atan(data[at + RVY6] * slip)) * data[at + LVYKA]


@formula
def equivalent(tangent, slip, ratio, legacy):
    """Return the slip angle that stands for combined slip (4.E77, 4.E78); ``ratio``: of the stiffnesses."""
    x = choose(legacy, tan_of(tangent), tangent)
    both = sqrt(x * x + ratio * ratio * slip * slip + 1e-30) * choose(tangent, 1.0, -1.0)
    return choose(legacy, atan(both), both)


@formula
def tan_of(x):
    """Return the tangent of an angle."""
    return sin(x) / cos(x)


@formula
def aligning(data, at, friction, slip, tangent, camber, load, along, force, of_force):
    """Return the aligning moment (4.E31 to 4.E49, 4.E71 to 4.E78).

    ``force``: longitudinal and lateral force; ``of_force``: the force on the trail, B C of the lateral force, SHy, SVy.
    """
    nominal, df, dp = reference(data, at, load)
    fx, fy = force
    on_trail, bc, h, v = of_force
    scale, legacy = friction * data[at + LMUY], data[at + LEGACY]
    k = cornering_stiffness(data, at, load, camber)
    k = k - SMALL * nominal
    ratio = slip_stiffness(data, at, load) / k
    size = absolute(camber)
    x = tangent + data[at + QHZ1] + data[at + QHZ2] * df + (data[at + QHZ3] + data[at + QHZ4] * df) * camber
    bend = choose(legacy, data[at + QBZ4] * camber, data[at + QBZ6] * camber * camber)
    b = (data[at + QBZ1] + df * (data[at + QBZ2] + data[at + QBZ3] * df)) * (1.0 + data[at + QBZ5] * size + bend)
    b = b * data[at + LKY] / (scale + SMALL)
    d = load * data[at + RADIUS] / nominal * (data[at + QDZ1] + data[at + QDZ2] * df) * (1.0 - data[at + PPZ1] * dp)
    d = d * (1.0 + data[at + QDZ3] * choose(legacy, camber, size) + data[at + QDZ4] * camber * camber) * data[at + LTR]
    e = data[at + QEZ1] + df * (data[at + QEZ2] + data[at + QEZ3] * df)
    c = data[at + QCZ1]
    e = e * (1.0 + (data[at + QEZ4] + data[at + QEZ5] * camber) * TWO_BY_PI * atan(b * c * x))
    trail = d * cosine(b, c, e, equivalent(x, slip, ratio, legacy)) * along
    residual = tangent + h + v / k
    br = data[at + QBZ9] * data[at + LKY] / (scale + SMALL) + data[at + QBZ10] * bc
    dr = (data[at + QDZ6] + data[at + QDZ7] * df) * data[at + LRES]
    leaning = (data[at + QDZ8] + data[at + QDZ9] * df) * (1.0 + data[at + PPZ2] * dp)
    dr = dr + (leaning + (data[at + QDZ10] + data[at + QDZ11] * df) * size) * camber * data[at + LKZC]
    dr = dr * load * data[at + RADIUS] * scale * along
    rest = dr * cos(atan(br * equivalent(residual, slip, ratio, legacy)))
    arm = data[at + SSZ1] + data[at + SSZ2] * fy / nominal + (data[at + SSZ3] + data[at + SSZ4] * df) * camber
    return rest - trail * on_trail + data[at + RADIUS] * arm * data[at + LS] * fx


@formula
def overturning(data, at, fy, camber, load):
    """Return the overturning moment (4.E69)."""
    nominal, _, dp = reference(data, at, load)
    part, side = load / nominal, fy / nominal
    squared = data[at + QSX6] * part
    leaning = sin(data[at + QSX7] * camber + data[at + QSX8] * atan(data[at + QSX9] * side))
    m = data[at + QSX1] * data[at + LVMX] - data[at + QSX2] * camber * (1.0 + data[at + PPMX1] * dp)
    m = m + data[at + QSX3] * side + data[at + QSX4] * cos(data[at + QSX5] * atan(squared * squared)) * leaning
    m = m + data[at + QSX10] * atan(data[at + QSX11] * part) * camber
    return data[at + RADIUS] * load * m * data[at + LMX]


@formula
def rolling(data, at, fx, camber, load, motion):
    """Return the rolling resistance (4.E70): a moment against the turning of the wheel."""
    nominal, _, _ = reference(data, at, load)
    pace = absolute(motion[1]) / data[at + LONGVL]
    part = load / nominal
    m = data[at + QSY1] + data[at + QSY2] * fx / nominal + data[at + QSY3] * pace
    m = m + data[at + QSY4] * integer_power(pace, 4) + (data[at + QSY5] + data[at + QSY6] * part) * camber * camber
    grown = power(maximum(part, 0.0 * part + SMALL), data[at + QSY7] + 0.0 * part)
    sense = spin_direction(data[at + RADIUS], motion)
    pressure = power(data[at + PRESSURE], data[at + QSY8])
    return -data[at + RADIUS] * nominal * m * grown * pressure * data[at + LMY] * sense


@formula
def load(data, at, deflection, rate, spin, camber):
    """Return the load (4.E68 without the terms of Fx and Fy) and the effective rolling radius (7.7 and 7.8)."""
    radius, nominal, dp = data[at + RADIUS], data[at + FNOMIN], data[at + PRESSURE] - 1.0
    pace = spin * radius / data[at + LONGVL]
    free = radius * (data[at + QRE0] + data[at + QV1] * pace * pace)
    pressed = choose(deflection, deflection, 0.0 * deflection) / radius
    stiffening = (1.0 + data[at + QV2] * absolute(pace)) * (1.0 + data[at + PFZ1] * dp)
    elastic = (data[at + QFZ1] + data[at + QFZ3] * camber * camber + data[at + QFZ2] * pressed) * pressed * nominal
    total = damped_load(data, at, elastic * stiffening, deflection, rate)
    part = total / nominal
    sunk = data[at + DREFF] * atan(data[at + BREFF] * part) + data[at + FREFF] * part
    return total, free - nominal / data[at + STIFFNESS] * sunk


@formula
def relaxation(data, at, friction, load, camber):
    """Return the relaxation lengths, and the slips at which the forces are past their peaks.

    Of version 6.x: slip stiffness over the stiffness of the carcass (Pacejka 2012, section 7.2); where no stiffness is
    given, and of version 5.2, by PTX1 to PTY2 (PAC2002).
    """
    nominal, df, _ = reference(data, at, load)
    radius = data[at + RADIUS]
    kx, ky = slip_stiffness(data, at, load), -cornering_stiffness(data, at, load, camber)
    x = load * (data[at + PTX1] + data[at + PTX2] * df) * exp(-data[at + PTX3] * df) * radius / nominal
    y = data[at + PTY1] * sin(2.0 * atan(load / (data[at + PTY2] * nominal))) * radius * data[at + LFZO]
    y = y * (1.0 - data[at + PKY3] * absolute(camber))
    x = choose(data[at + CLONG], kx / choose(data[at + CLONG], data[at + CLONG], 1.0), x)
    y = choose(data[at + CLAT], ky / choose(data[at + CLAT], data[at + CLAT], 1.0), y)
    least = LEAST_RELAXATION * radius + 0.0 * x
    peak = PEAK * friction * load
    limit_x = peak * data[at + PDX1] * data[at + LMUX] / (kx + SMALL * nominal)
    limit_y = peak * data[at + PDY1] * data[at + LMUY] / (ky + SMALL * nominal)
    slip = 0.0 * x + 1e-3
    x, y = maximum(x * data[at + LSGKP], least), maximum(y * data[at + LSGAL], least)
    return x, y, maximum(limit_x, slip), maximum(limit_y, slip)


@formula
def slip_forces(data, at, friction, slip, tangent, camber, load, motion):
    """Return forces and moments of combined slip; see the module's docstring."""
    along = motion[0]
    legacy = data[at + LEGACY]
    _, df, _ = reference(data, at, load)
    a = choose(legacy, atan(tangent), tangent)
    fx = longitudinal(data, at, friction, slip, camber * data[at + LGAX], load)
    fx = fx * longitudinal_weight(data, at, slip, a, camber, df)
    gy, gz = camber * data[at + LGAY], camber * data[at + LGAZ]
    pure, mu, bc, h, v = lateral(data, at, friction, a, gy, load)
    straight, _, _, _, _ = lateral(data, at, friction, a, 0.0 * gy, load)
    weighted = pure * lateral_weight(data, at, slip, a, camber, df)
    fy = weighted + induced_lateral(data, at, mu, slip, a, camber, load, df)
    upright = straight * lateral_weight(data, at, slip, a, 0.0 * camber, df)
    on_trail = choose(legacy, weighted, upright)
    mz = aligning(data, at, friction, slip, a, gz, load, along, (fx, fy), (on_trail, bc, h, v))
    return fx, fy, overturning(data, at, fy, camber, load), rolling(data, at, fx, camber, load, motion), mz


@element
class MagicFormula(LinkedFile, TyreModel):
    """The Magic Formula of Pacejka with the coefficients of a tyre property file (``.tir``), versions 5.2 and 6.x.

    It gives forces and moments of combined slip and camber, load, rolling radius, relaxation lengths, overturning
    moment and rolling resistance. A file of version 5.0 to 5.2 (``FITTYP`` 5, 6, 21, 51, 52, or PAC2002) is evaluated
    by the formulas of that version, others by those of 6.1. Turn slip is not modelled.

    Parameters
    ----------
    name : str
        Optional.
    path : str
        The file. A relative path refers to the folder of the model file, or to the current folder.
    coefficients : mapping or list of pairs
        Coefficients by their names in files, in place of a file or of those in it: ``{"LMUY": 0.8}``. Numbers or
        expressions of parameters.
    pressure : number [Pa]
        Inflation pressure; that of the file if not given.
    """

    path: FilePath = None
    coefficients: NamedNumbers = ()
    pressure: Annotated[Number | None, Unit("Pa")] = None

    kind: ClassVar[int] = KIND
    load: ClassVar = staticmethod(load)
    relaxation: ClassVar = staticmethod(relaxation)
    slip_forces: ClassVar = staticmethod(slip_forces)

    __eq__, __hash__ = LinkedFile.__eq__, LinkedFile.__hash__

    @property
    def title(self) -> str:
        """Kind, and name or path if it has one, for messages."""
        told = self.name or self.path
        return f"{type(self).__name__} {told!r}" if told else type(self).__name__

    def derive(self, n: SimpleNamespace, env: Mapping[str, Any]) -> None:
        """Read the file, and add the coefficients as numbers."""
        found = read_tir(self.file, self.title) if self.file else TyreData(MappingProxyType({}), False, False)
        own = {k: number(x, env, None, f"{k} of {self.title}") for k, x in self.coefficients}
        for name in own:
            if name not in OWN_NAMES and name not in OTHER_NAMES and name not in RANGE_NAMES:
                raise ModelError(f"{self.title}: unknown coefficient {name!r}{suggest(name, OWN_NAMES)}")
        n.given = dict(found.numbers) | own
        n.all = completed(n.given, self.title)
        n.legacy, n.right = found.legacy, found.right
        if n.pressure is not None and not n.all["NOMPRES"].real > 0.0:
            raise ModelError(
                f"{self.title}: its coefficients have no NOMPRES, so the pressure has no effect; leave it out"
            )

    def check(self, n: SimpleNamespace) -> None:
        """Require numbers that make a tyre."""
        positive(self, n, "pressure")
        if not self.path and not self.coefficients:
            raise ModelError(f"{self.title}: give the path of a tyre property file, or coefficients=")
        for name in ("UNLOADED_RADIUS", "FNOMIN", "VERTICAL_STIFFNESS", "LONGVL", "LFZO"):
            if not n.all[name].real > 0.0:
                raise ModelError(f"{self.title}: {name} is {n.all[name]:g}; it must be greater than 0")
        if not n.all["PKY1"].real < 0.0:
            raise ModelError(
                f"{self.title}: PKY1 is {n.all['PKY1']:g}; in the ISO axes of tyre property files it is negative. "
                f"Change the signs of the coefficients of another system of axes"
            )

    def numbers(self, n: SimpleNamespace) -> tuple[Any, ...]:
        """Return the numbers of its formulas."""
        x = n.all
        nominal = x["NOMPRES"] if x["NOMPRES"].real > 0.0 else 1.0
        actual = n.pressure if n.pressure is not None else x["INFLPRES"] if x["INFLPRES"].real > 0.0 else nominal
        ratio = actual / nominal if x["NOMPRES"].real > 0.0 else 1.0
        first = (x["UNLOADED_RADIUS"], x["VERTICAL_STIFFNESS"], x["VERTICAL_DAMPING"])
        return (*first, *(x[k] for k in OWN_NAMES), ratio, float(n.legacy))

    def measured_right(self, n: SimpleNamespace) -> bool | None:
        """Return whether it was measured on the right side of a vehicle."""
        return n.right  # type: ignore[no-any-return]

    def limits(self, n: SimpleNamespace) -> dict[str, tuple[float, float]]:
        """Return the ranges of load, slip, slip angle and camber that its file gives."""
        known = n.given
        return {k: (known[a], known[b]) for k, (a, b) in RANGES.items() if known.get(a, 0.0) < known.get(b, 0.0)}
