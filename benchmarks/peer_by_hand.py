"""Andrews' mechanism by equations derived by hand, as published with the test set, in solvers of ODEs and DAEs.

Problem II-13 of the Test Set for IVP Solvers (Mazzia and Magherini 2008), after Hairer and Wanner (1996), VII.7.
Solvers: SUNDIALS' IDA and CVODE through scikit-sundae, SciPy's DOP853. What they integrate: with IDA index 1,
(q, v, lambda) by M v' + G^T lambda = f, G v' = gamma; with the others the accelerations that follow from these. What
Numba compiles does all arithmetic; a call of it from the solver takes under a microsecond.
"""

from __future__ import annotations

import time
from math import cos, hypot, sin
from typing import Any

import numpy as np
from numba import njit

M1, M2, M3, M4, M5, M6, M7 = 0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498
XA, YA, XB, YB, XC, YC, C0 = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072, 4530.0
I1, I2, I3, I4, I5, I6, I7 = 2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5
D, DA, E, EA, RR, RA, L0 = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092, 0.07785
SS, SA, SB, SC, SD, TA, TB = 0.035, 0.01874, 0.01043, 0.018, 0.02, 0.02308, 0.00916
U, UA, UB, ZF, ZT, FA, MOM = 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421, 0.033


@njit(cache=True)
def masses(q, M):
    """Mass matrix."""
    M[:] = 0.0
    M[0, 0] = M1 * RA**2 + M2 * (RR**2 - 2 * DA * RR * cos(q[1]) + DA**2) + I1 + I2
    M[0, 1] = M[1, 0] = M2 * (DA**2 - DA * RR * cos(q[1])) + I2
    M[1, 1] = M2 * DA**2 + I2
    M[2, 2] = M3 * (SA**2 + SB**2) + I3
    M[3, 3] = M4 * (E - EA) ** 2 + I4
    M[3, 4] = M[4, 3] = M4 * ((E - EA) ** 2 + ZT * (E - EA) * sin(q[3])) + I4
    M[4, 4] = M4 * (ZT**2 + 2 * ZT * (E - EA) * sin(q[3]) + (E - EA) ** 2) + M5 * (TA**2 + TB**2) + I4 + I5
    M[5, 5] = M6 * (ZF - FA) ** 2 + I6
    M[5, 6] = M[6, 5] = M6 * ((ZF - FA) ** 2 - U * (ZF - FA) * sin(q[5])) + I6
    M[6, 6] = M6 * ((ZF - FA) ** 2 - 2 * U * (ZF - FA) * sin(q[5]) + U**2) + M7 * (UA**2 + UB**2) + I6 + I7


@njit(cache=True)
def forces(q, v, f):
    """Applied and centrifugal forces."""
    th, ga, ph, om = q[1], q[2], q[3], q[5]
    x, y = SD * cos(ga) + SC * sin(ga) + XB, SD * sin(ga) - SC * cos(ga) + YB
    L = hypot(x - XC, y - YC)
    F = -C0 * (L - L0) / L
    f[0] = MOM - M2 * DA * RR * v[1] * (v[1] + 2 * v[0]) * sin(th)
    f[1] = M2 * DA * RR * v[0] ** 2 * sin(th)
    f[2] = F * (x - XC) * (SC * cos(ga) - SD * sin(ga)) + F * (y - YC) * (SD * cos(ga) + SC * sin(ga))
    f[3] = M4 * ZT * (E - EA) * v[4] ** 2 * cos(ph)
    f[4] = -M4 * ZT * (E - EA) * v[3] * (v[3] + 2 * v[4]) * cos(ph)
    f[5] = -M6 * U * (ZF - FA) * v[6] ** 2 * cos(om)
    f[6] = M6 * U * (ZF - FA) * v[5] * (v[5] + 2 * v[6]) * cos(om)


@njit(cache=True)
def rows(q, v, G, gamma):
    """Jacobian of the six loop equations, and - G' v."""
    be, th, ga, ph, de, om, ep = q[0], q[1], q[2], q[3], q[4], q[5], q[6]
    G[:] = 0.0
    for r in (0, 2, 4):
        G[r, 0], G[r, 1] = -RR * sin(be) + D * sin(be + th), D * sin(be + th)
        G[r + 1, 0], G[r + 1, 1] = RR * cos(be) - D * cos(be + th), -D * cos(be + th)
    G[0, 2], G[1, 2] = -SS * cos(ga), -SS * sin(ga)
    G[2, 3], G[2, 4] = -E * cos(ph + de), -E * cos(ph + de) + ZT * sin(de)
    G[3, 3], G[3, 4] = -E * sin(ph + de), -E * sin(ph + de) - ZT * cos(de)
    G[4, 5], G[4, 6] = ZF * sin(om + ep), ZF * sin(om + ep) - U * cos(ep)
    G[5, 5], G[5, 6] = -ZF * cos(om + ep), -ZF * cos(om + ep) - U * sin(ep)
    b, a, c, w = v[0], v[0] + v[1], v[3] + v[4], v[5] + v[6]
    x = -RR * cos(be) * b**2 + D * cos(be + th) * a**2
    y = -RR * sin(be) * b**2 + D * sin(be + th) * a**2
    gamma[0] = -x - SS * sin(ga) * v[2] ** 2
    gamma[1] = -y + SS * cos(ga) * v[2] ** 2
    gamma[2] = -x - E * sin(ph + de) * c**2 - ZT * cos(de) * v[4] ** 2
    gamma[3] = -y + E * cos(ph + de) * c**2 - ZT * sin(de) * v[4] ** 2
    gamma[4] = -x - ZF * cos(om + ep) * w**2 - U * sin(ep) * v[6] ** 2
    gamma[5] = -y - ZF * sin(om + ep) * w**2 + U * cos(ep) * v[6] ** 2


@njit(cache=True)
def solved(y, K, b):
    """Accelerations and multipliers at y = (q, v, ...), into b: Gauss with pivots."""
    q, v = y[:7], y[7:14]
    K[:] = 0.0
    masses(q, K[:7, :7])
    rows(q, v, K[7:, :7], b[7:])
    K[:7, 7:] = K[7:, :7].T
    forces(q, v, b)
    n = 13
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(K[i, k]) > abs(K[p, k]):
                p = i
        if p != k:
            for j in range(k, n):
                K[k, j], K[p, j] = K[p, j], K[k, j]
            b[k], b[p] = b[p], b[k]
        for i in range(k + 1, n):
            x = K[i, k] / K[k, k]
            if x != 0.0:
                for j in range(k + 1, n):
                    K[i, j] -= x * K[k, j]
                b[i] -= x * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= K[k, j] * b[j]
        b[k] /= K[k, k]


@njit(cache=True)
def derivative(y, dy, K, b):
    """The rates of (q, v)."""
    solved(y, K, b)
    for i in range(7):
        dy[i], dy[7 + i] = y[7 + i], b[i]


@njit(cache=True)
def residual(y, yp, out, K, b):
    """What (q, v, lambda) miss of the equations of index 1."""
    q, v = y[:7], y[7:14]
    K[:] = 0.0
    masses(q, K[:7, :7])
    rows(q, v, K[7:, :7], b[7:])
    forces(q, v, b)
    for i in range(7):
        out[i] = yp[i] - y[7 + i]
        s = -b[i]
        for j in range(7):
            s += K[i, j] * yp[7 + j]
        for r in range(6):
            s += K[7 + r, i] * y[14 + r]
        out[7 + i] = s
    for r in range(6):
        s = -b[7 + r]
        for j in range(7):
            s += K[7 + r, j] * yp[7 + j]
        out[14 + r] = s


def solve(start: np.ndarray, t_end: float, rtol: float, setting: str, samples: int = 0) -> tuple[Any, float]:
    """Integrate from rest. Returns ((q, v, ...) at the times, or None without samples; CPU seconds).

    Raises
    ------
    RuntimeError
        If the solver gives up.
    """
    K, b, y0 = np.zeros((13, 13)), np.zeros(13), np.r_[start, np.zeros(7)]
    times = np.linspace(0.0, t_end, max(samples, 2) + 1)

    def f(t: float, y: np.ndarray) -> np.ndarray:
        dy = np.empty(14)
        derivative(y, dy, K, b)
        return dy

    def f_into(t: float, y: np.ndarray, dy: np.ndarray) -> None:
        derivative(y, dy, K, b)

    def r_into(t: float, y: np.ndarray, yp: np.ndarray, out: np.ndarray) -> None:
        residual(y, yp, out, K, b)

    options = {"rtol": rtol, "atol": rtol, "max_num_steps": 1_000_000}
    a = f(0.0, y0)[7:]
    begin = time.process_time()
    if setting == "IDA":
        from sksundae.ida import IDA  # type: ignore[import-not-found]

        made = IDA(r_into, algebraic_idx=np.arange(14, 20), **options)
        found = made.solve(times, np.r_[y0, b[7:]], np.r_[np.zeros(7), a, np.zeros(6)])
    elif setting == "CVODE, Adams":
        from sksundae.cvode import CVODE  # type: ignore[import-not-found]

        found = CVODE(f_into, method="Adams", **options).solve(times, y0)
    else:
        from scipy.integrate import solve_ivp

        found = solve_ivp(f, (0.0, t_end), y0, setting, times if samples else None, rtol=rtol, atol=rtol)
        found.y = found.y.T
    seconds = time.process_time() - begin
    if not found.success:
        raise RuntimeError(str(found.message))
    return (found.y if samples else None), seconds
