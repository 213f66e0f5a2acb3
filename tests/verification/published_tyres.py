"""Coefficients of a tyre, and the Magic Formula written down once more from the book.

``MF61``: passenger car tyre 205/60R15 V91, 2.2 bar, after Pacejka, *Tire and Vehicle Dynamics*, 2012, appendix 3; some
digits may differ from the print, which changes no test.
"""

from math import atan, cos, exp, pi, sin, sqrt

MF61 = {
    "UNLOADED_RADIUS": 0.313, "FNOMIN": 4000.0, "VERTICAL_STIFFNESS": 209651.0, "VERTICAL_DAMPING": 50.0,
    "LONGVL": 16.67, "NOMPRES": 220000.0, "INFLPRES": 220000.0, "BREFF": 8.386, "DREFF": 0.25826, "FREFF": 0.07394,
    "Q_RE0": 0.9974, "Q_V1": 7.742e-4, "Q_V2": 0.04667, "Q_FZ2": 15.4, "PFZ1": 0.7098,
    "LONGITUDINAL_STIFFNESS": 358066.0, "LATERAL_STIFFNESS": 102673.0,
    "PCX1": 1.579, "PDX1": 1.0422, "PDX2": -0.08285, "PEX1": 0.11113, "PEX2": 0.3143, "PEX4": 0.001719,
    "PKX1": 21.687, "PKX2": 13.728, "PKX3": -0.4098, "PHX1": 2.1615e-4, "PHX2": 0.0011598, "PVX1": 2.0283e-5,
    "PVX2": 1.0568e-4, "PPX1": -0.3485, "PPX2": 0.37824, "PPX3": -0.09603, "PPX4": 0.06518,
    "RBX1": 13.046, "RBX2": 9.718, "RCX1": 0.9995, "REX1": -0.4403, "REX2": -0.4663, "RHX1": -9.968e-5,
    "QSX1": -0.007764, "QSX2": 1.1915, "QSX3": 0.013948, "QSX4": 4.912, "QSX5": 1.02, "QSX6": 22.83, "QSX7": 0.7104,
    "QSX8": -0.023393, "QSX9": 0.6581, "QSX10": 0.2824, "QSX11": 5.349,
    "PCY1": 1.338, "PDY1": 0.8785, "PDY2": -0.06452, "PEY1": -0.8057, "PEY2": -0.6046, "PEY3": 0.09854, "PEY4": -6.697,
    "PKY1": -15.324, "PKY2": 1.715, "PKY3": 0.3695, "PKY4": 2.0005, "PKY6": -0.8987, "PKY7": -0.23303,
    "PHY1": -0.001806, "PHY2": 0.00352, "PVY1": -0.00661, "PVY2": 0.03592, "PVY3": -0.162, "PVY4": -0.4864,
    "PPY1": -0.6255, "PPY2": -0.06523, "PPY3": -0.16666, "PPY4": 0.2811,
    "RBY1": 10.622, "RBY2": 7.82, "RBY3": 0.002037, "RCY1": 1.0587, "REY1": 0.3148, "REY2": 0.004867, "RHY1": 0.009472,
    "RHY2": 0.009754, "RVY1": 0.05187, "RVY2": 4.853e-4, "RVY4": 94.63, "RVY5": 1.8914, "RVY6": 23.8,
    "QSY1": 0.00702, "QSY3": 0.001515, "QSY4": 8.514e-5, "QSY7": 0.9008, "QSY8": -0.4089,
    "QBZ1": 12.035, "QBZ2": -1.33, "QBZ4": 0.176, "QBZ5": -0.14853, "QBZ9": 34.5, "QCZ1": 1.2923, "QDZ1": 0.09068,
    "QDZ2": -0.00565, "QDZ3": 0.3778, "QDZ6": 0.0017015, "QDZ7": -0.002091, "QDZ8": -0.1428, "QDZ9": 0.00915,
    "QEZ1": -1.7924, "QEZ2": 0.8975, "QEZ4": 0.2895, "QEZ5": -0.6786, "QHZ1": 0.0014333, "QHZ2": 0.0024087,
    "QHZ3": 0.24973, "QHZ4": -0.21205, "PPZ1": -0.4408, "SSZ1": 0.00918, "SSZ2": 0.03869,
}  # fmt: skip


def sign(x):
    return (x > 0) - (x < 0)


def magic(b, c, d, e, x):
    return d * sin(c * atan(b * x - e * (b * x - atan(b * x))))


def mf61(coefficients, fz, kappa, alpha, gamma, p=220000.0, v=10.0):
    """Fx, Fy, Mx, Mz by the equations 4.E9 to 4.E78, as they stand there (scale factors 1, no turn slip)."""

    class C:
        def __getattr__(self, name):
            return coefficients.get(name, 0.0)

    c = C()
    fz0, r0 = c.FNOMIN, c.UNLOADED_RADIUS
    df, dp, g, a = (fz - fz0) / fz0, (p - c.NOMPRES) / c.NOMPRES, sin(gamma), alpha
    # longitudinal force
    kx = kappa + c.PHX1 + c.PHX2 * df
    mux = (c.PDX1 + c.PDX2 * df) * (1 + c.PPX3 * dp + c.PPX4 * dp**2) * (1 - c.PDX3 * g**2)
    dx = mux * fz
    ex = (c.PEX1 + c.PEX2 * df + c.PEX3 * df**2) * (1 - c.PEX4 * sign(kx))
    kxk = fz * (c.PKX1 + c.PKX2 * df) * exp(c.PKX3 * df) * (1 + c.PPX1 * dp + c.PPX2 * dp**2)
    fx0 = magic(kxk / (c.PCX1 * dx), c.PCX1, dx, ex, kx) + fz * (c.PVX1 + c.PVX2 * df)
    bxa = (c.RBX1 + c.RBX3 * g**2) * cos(atan(c.RBX2 * kappa))
    exa = c.REX1 + c.REX2 * df

    def part(b, cc, e, x):
        return cos(cc * atan(b * x - e * (b * x - atan(b * x))))

    fx = fx0 * part(bxa, c.RCX1, exa, a + c.RHX1) / part(bxa, c.RCX1, exa, c.RHX1)

    def lateral(g):
        muy = (c.PDY1 + c.PDY2 * df) * (1 + c.PPY3 * dp + c.PPY4 * dp**2) * (1 - c.PDY3 * g**2)
        peak = (c.PKY2 + c.PKY5 * g**2) * (1 + c.PPY2 * dp)
        kya = c.PKY1 * fz0 * (1 + c.PPY1 * dp) * (1 - c.PKY3 * abs(g)) * sin(c.PKY4 * atan(fz / fz0 / peak))
        svg = fz * (c.PVY3 + c.PVY4 * df) * g
        kyg = fz * (c.PKY6 + c.PKY7 * df) * (1 + c.PPY5 * dp)
        shy = c.PHY1 + c.PHY2 * df + (kyg * g - svg) / kya
        svy = fz * (c.PVY1 + c.PVY2 * df) + svg
        ay = a + shy
        ey = (c.PEY1 + c.PEY2 * df) * (1 + c.PEY5 * g**2 - (c.PEY3 + c.PEY4 * g) * sign(ay))
        by = kya / (c.PCY1 * muy * fz)
        weight = (c.RBY1 + c.RBY4 * g**2) * cos(atan(c.RBY2 * (a - c.RBY3)))
        shk, eyk = c.RHY1 + c.RHY2 * df, c.REY1 + c.REY2 * df
        gy = part(weight, c.RCY1, eyk, kappa + shk) / part(weight, c.RCY1, eyk, shk)
        return magic(by, c.PCY1, muy * fz, ey, ay) + svy, muy, kya, shy, svy, by, gy

    fy0, muy, kya, shy, svy, by, gy = lateral(g)
    dvy = muy * fz * (c.RVY1 + c.RVY2 * df + c.RVY3 * g) * cos(atan(c.RVY4 * a))
    fy = gy * fy0 + dvy * sin(c.RVY5 * atan(c.RVY6 * kappa))
    # aligning moment
    up = lateral(0.0)
    at = a + c.QHZ1 + c.QHZ2 * df + (c.QHZ3 + c.QHZ4 * df) * g
    bt = (c.QBZ1 + c.QBZ2 * df + c.QBZ3 * df**2) * (1 + c.QBZ5 * abs(g) + c.QBZ6 * g**2)
    dt = fz * r0 / fz0 * (c.QDZ1 + c.QDZ2 * df) * (1 - c.PPZ1 * dp) * (1 + c.QDZ3 * abs(g) + c.QDZ4 * g**2)
    et = c.QEZ1 + c.QEZ2 * df + c.QEZ3 * df**2
    et *= 1 + (c.QEZ4 + c.QEZ5 * g) * 2 / pi * atan(bt * c.QCZ1 * at)
    cosine = 1 / sqrt(1 + a**2)
    ateq = sqrt(at**2 + (kxk / kya) ** 2 * kappa**2) * sign(at)
    trail = dt * part(bt, c.QCZ1, min(et, 1), ateq) * cosine
    ar = a + shy + svy / kya
    areq = sqrt(ar**2 + (kxk / kya) ** 2 * kappa**2) * sign(ar)
    dr = c.QDZ6 + c.QDZ7 * df
    dr += ((c.QDZ8 + c.QDZ9 * df) * (1 + c.PPZ2 * dp) + (c.QDZ10 + c.QDZ11 * df) * abs(g)) * g
    mzr = fz * r0 * dr * cosine * cos(atan((c.QBZ9 + c.QBZ10 * by * c.PCY1) * areq))
    s = r0 * (c.SSZ1 + c.SSZ2 * fy / fz0 + (c.SSZ3 + c.SSZ4 * df) * g)
    mz = -trail * up[6] * up[0] + mzr + s * fx
    mx = c.QSX1 - c.QSX2 * g * (1 + c.PPMX1 * dp) + c.QSX3 * fy / fz0
    mx += c.QSX4 * cos(c.QSX5 * atan((c.QSX6 * fz / fz0) ** 2)) * sin(c.QSX7 * g + c.QSX8 * atan(c.QSX9 * fy / fz0))
    mx = r0 * fz * (mx + c.QSX10 * atan(c.QSX11 * fz / fz0) * g)
    return fx, fy, mx, mz
