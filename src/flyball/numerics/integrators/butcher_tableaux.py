"""Explicit Runge-Kutta methods as data: DOP853, RK45, and methods defined by the user.

A new method is an entry of ``TABLEAUX``; `runge_kutta` adds one and checks its order conditions.

DOP853 is Dormand and Prince's method of order 8(5,3) in 12 stages with dense output of order 7: E. Hairer, S.
P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, 2nd edition (1993), sections II.5 and II.6;
the numbers are those of the authors' program dop853.f. A row of a matrix is written as column -> number.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from ...compiler.struct_layout import Float1, Float2, Int1
from ...errors import ModelError

DOP853_C = (
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
    1.0,
    0.1,
    0.2,
    0.7777777777777778,
)
DOP853_A: tuple[dict[int, float], ...] = (
    {},
    {0: 0.05260015195876773},
    {0: 0.0197250569845379, 1: 0.0591751709536137},
    {0: 0.02958758547680685, 2: 0.08876275643042054},
    {0: 0.2413651341592667, 2: -0.8845494793282861, 3: 0.924834003261792},
    {0: 0.037037037037037035, 3: 0.17082860872947386, 4: 0.12546768756682242},
    {0: 0.037109375, 3: 0.17025221101954405, 4: 0.06021653898045596, 5: -0.017578125},
    {
        0: 0.03709200011850479,
        3: 0.17038392571223998,
        4: 0.10726203044637328,
        5: -0.015319437748624402,
        6: 0.008273789163814023,
    },
    {
        0: 0.6241109587160757,
        3: -3.3608926294469414,
        4: -0.868219346841726,
        5: 27.59209969944671,
        6: 20.154067550477894,
        7: -43.48988418106996,
    },
    {
        0: 0.47766253643826434,
        3: -2.4881146199716677,
        4: -0.590290826836843,
        5: 21.230051448181193,
        6: 15.279233632882423,
        7: -33.28821096898486,
        8: -0.020331201708508627,
    },
    {
        0: -0.9371424300859873,
        3: 5.186372428844064,
        4: 1.0914373489967295,
        5: -8.149787010746927,
        6: -18.52006565999696,
        7: 22.739487099350505,
        8: 2.4936055526796523,
        9: -3.0467644718982196,
    },
    {
        0: 2.273310147516538,
        3: -10.53449546673725,
        4: -2.0008720582248625,
        5: -17.9589318631188,
        6: 27.94888452941996,
        7: -2.8589982771350235,
        8: -8.87285693353063,
        9: 12.360567175794303,
        10: 0.6433927460157636,
    },
    {
        0: 0.054293734116568765,
        5: 4.450312892752409,
        6: 1.8915178993145003,
        7: -5.801203960010585,
        8: 0.3111643669578199,
        9: -0.1521609496625161,
        10: 0.20136540080403034,
        11: 0.04471061572777259,
    },  # the step
    {
        0: 0.056167502283047954,
        6: 0.25350021021662483,
        7: -0.2462390374708025,
        8: -0.12419142326381637,
        9: 0.15329179827876568,
        10: 0.00820105229563469,
        11: 0.007567897660545699,
        12: -0.008298,
    },
    {
        0: 0.03183464816350214,
        5: 0.028300909672366776,
        6: 0.053541988307438566,
        7: -0.05492374857139099,
        10: -0.00010834732869724932,
        11: 0.0003825710908356584,
        12: -0.00034046500868740456,
        13: 0.1413124436746325,
    },
    {
        0: -0.42889630158379194,
        5: -4.697621415361164,
        6: 7.683421196062599,
        7: 4.06898981839711,
        8: 0.3567271874552811,
        12: -0.0013990241651590145,
        13: 2.9475147891527724,
        14: -9.15095847217987,
    },
)
"""Coefficients of stage i; the 13th is the step itself, the last three are for dense output only."""
DOP853_E5 = {
    0: 0.01312004499419488,
    5: -1.2251564463762044,
    6: -0.4957589496572502,
    7: 1.6643771824549864,
    8: -0.35032884874997366,
    9: 0.3341791187130175,
    10: 0.08192320648511571,
    11: -0.022355307863886294,
}
"""Error estimate of order 5."""
DOP853_E3 = {
    0: -0.18980075407240762,
    5: 4.450312892752409,
    6: 1.8915178993145003,
    7: -5.801203960010585,
    8: -0.4226823213237919,
    9: -0.1521609496625161,
    10: 0.20136540080403034,
    11: 0.02265179219836082,
}
"""Error estimate of order 3, which damps that of order 5."""
DOP853_D: tuple[dict[int, float], ...] = (
    {
        0: -8.428938276109013,
        5: 0.5667149535193777,
        6: -3.0689499459498917,
        7: 2.38466765651207,
        8: 2.117034582445028,
        9: -0.871391583777973,
        10: 2.2404374302607883,
        11: 0.6315787787694688,
        12: -0.08899033645133331,
        13: 18.148505520854727,
        14: -9.194632392478356,
        15: -4.436036387594894,
    },
    {
        0: 10.427508642579134,
        5: 242.28349177525817,
        6: 165.20045171727028,
        7: -374.5467547226902,
        8: -22.113666853125306,
        9: 7.733432668472264,
        10: -30.674084731089398,
        11: -9.332130526430229,
        12: 15.697238121770845,
        13: -31.139403219565178,
        14: -9.35292435884448,
        15: 35.81684148639408,
    },
    {
        0: 19.985053242002433,
        5: -387.0373087493518,
        6: -189.17813819516758,
        7: 527.8081592054236,
        8: -11.57390253995963,
        9: 6.8812326946963,
        10: -1.0006050966910838,
        11: 0.7777137798053443,
        12: -2.778205752353508,
        13: -60.19669523126412,
        14: 84.32040550667716,
        15: 11.99229113618279,
    },
    {
        0: -25.69393346270375,
        5: -154.18974869023643,
        6: -231.5293791760455,
        7: 357.6391179106141,
        8: 93.40532418362432,
        9: -37.45832313645163,
        10: 104.0996495089623,
        11: 29.8402934266605,
        12: -43.53345659001114,
        13: 96.32455395918828,
        14: -39.17726167561544,
        15: -149.72683625798564,
    },
)
"""Coefficients of dense output, in addition to values and slopes at both ends."""


INTERPOLANT_ERROR_SCALE, INTERPOLANT_ERROR_DAMPING = 1.6e-3, 0.2
"""Scale and damping that turn the coefficients c7, c6 of dop853's dense output into a bound of its error.

See `explicit_runge_kutta.dense_output_error`. For y' = lambda y the error is 1.2e-3 c7, within a fifth, for h |lambda|
from 1 to 6.5 and any argument of lambda; and c7 is c6/3 from 2 on. For narrow steps c7/c6 is small, and the error is
about c8/256, with c8 = c7^2/c6. The error estimate of the step does not show this: on the real axis, as h lambda goes
to -6, the error of the dense output is 80 times the estimate, where rk45's never exceeds 2.5 times.
"""


class Tableau(NamedTuple):
    """An explicit pair with dense output, stored as arrays so that one compiled loop serves every method.

    Stage i is f(t + c[i] h, y + h sum A[i, j] K[j]). The first ``order_i[1]`` stages define the step, the next is the
    derivative at its end, the rest are only for dense output. The interpolant is
    y(t + x h) = y + h sum_j K[j] sum_p P[j, p] x^(p + 1).
    """

    A: Float2  # (all stages, all stages)
    c: Float1  # (all stages,)
    E: Float2  # (2, all stages): two error estimates; the second damps the first (zero: not used)
    P: Float2  # (all stages, degree)
    D: Float2  # (2, all stages): error of the interpolant, and its damping; zero if the error of the step bounds it
    order_i: Int1  # order for step control, stages of a step, all stages


def _rk45() -> Tableau:
    """Dormand and Prince (1980), order 5(4), 6 stages; dense output of order 4 by Shampine (1986)."""
    stages = [
        [],
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
    A = np.array([row + [0.0] * (7 - len(row)) for row in stages])
    c = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
    E = np.zeros((2, 7))
    E[0] = [-71 / 57600, 0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40]
    P = np.array(
        [
            [1, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
            [0, 0, 0, 0],
            [0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
            [0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
            [0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
            [0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
            [0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
        ]
    )
    return Tableau(A, c, E, P, np.zeros((2, 7)), np.array([5, 6, 7], np.int64))


def _dop853() -> Tableau:
    """Dormand and Prince, order 8(5,3), 12 stages, dense output of order 7; for sources see the module docstring."""
    s = len(DOP853_C)
    A = np.array([_dense_row(row, s) for row in DOP853_A])
    E = np.array([_dense_row(DOP853_E5, s), _dense_row(DOP853_E3, s)])
    # y + x (F0 + (1 - x) (F1 + x (F2 + (1 - x) (...)))): expanded into powers of x
    B, first, last = A[12], np.eye(s)[0], np.eye(s)[12]
    F = [B, first - B, 2 * B - first - last, *(_dense_row(row, s) for row in DOP853_D)]
    total = np.zeros((s, 1))
    for i in range(len(F) - 1, -1, -1):
        total[:, 0] += F[i]
        factor = np.array([0.0, 1.0]) if i % 2 == 0 else np.array([1.0, -1.0])
        total = np.stack([np.convolve(row, factor) for row in total])
    P = np.ascontiguousarray(total[:, 1:])
    D = INTERPOLANT_ERROR_SCALE * np.stack([P[:, -1], INTERPOLANT_ERROR_DAMPING * P[:, -2]])
    return Tableau(A, np.array(DOP853_C), E, P, D, np.array([8, 12, s], np.int64))


def _dense_row(row: Mapping[int, float], length: int) -> np.ndarray:
    out = np.zeros(length)
    out[list(row)] = list(row.values())
    return out


TABLEAUX = {"dop853": _dop853, "rk45": _rk45}


@cache
def tableau(name: str) -> Tableau:
    """Return the method of that name.

    Raises
    ------
    ValueError
        If there is no such method; the message lists those there are.
    """
    if name not in TABLEAUX:
        raise ValueError(f"unknown integrator {name!r}; choose one of {', '.join(sorted(TABLEAUX))}")
    return TABLEAUX[name]()


ORDER_CONDITIONS: dict[int, list[tuple[str, float, Callable[[np.ndarray, np.ndarray, np.ndarray], float]]]] = {
    1: [("sum b_i", 1.0, lambda A, b, c: b.sum())],
    2: [("sum b_i c_i", 1 / 2, lambda A, b, c: b @ c)],
    3: [("sum b_i c_i^2", 1 / 3, lambda A, b, c: b @ c**2), ("sum b_i a_ij c_j", 1 / 6, lambda A, b, c: b @ A @ c)],
    4: [
        ("sum b_i c_i^3", 1 / 4, lambda A, b, c: b @ c**3),
        ("sum b_i c_i a_ij c_j", 1 / 8, lambda A, b, c: (b * c) @ A @ c),
        ("sum b_i a_ij c_j^2", 1 / 12, lambda A, b, c: b @ A @ c**2),
        ("sum b_i a_ij a_jk c_k", 1 / 24, lambda A, b, c: b @ A @ A @ c),
    ],
}
"""Order conditions: Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I* (1993), table II.2.1."""
COEFFICIENT_TOLERANCE = 1e-10  # for coefficients that are given as decimals


def runge_kutta(
    name: str,
    A: Sequence[Sequence[float]],
    b: Sequence[float],
    order: int,
    *,
    embedded: Sequence[float] | None = None,
    dense: Sequence[Sequence[float]] | None = None,
) -> None:
    """Define an explicit Runge-Kutta method, to be used as ``simulate(method=name)``.

    Parameters
    ----------
    name : str
    A : s rows
        Row i holds the coefficients of the stages before stage i; a row may be shorter than s. The sums of the rows are
        the nodes c_i, the places of the stages in the step.
    b : s numbers
        Weights of the stages.
    order : int
        Order of accuracy. The order conditions up to 4 are checked.
    embedded : s or s + 1 numbers, optional
        Weights of a second solution of one order less. The difference of both is the error for step control. The number
        s + 1 belongs to the derivative at the end of the step. Without embedded weights, ``simulate`` needs ``step=``.
    dense : s + 1 rows, optional
        For the state at a part x of a step: coefficients of x, x^2, ... of each stage, and of the derivative at the
        end. Default: cubic Hermite interpolation, for an order of at most 4.

    Raises
    ------
    ModelError
        If the name is taken, or the coefficients do not define a method of this order.
    """
    who = f"Runge-Kutta method {name!r}"
    s = len(b)
    rows = [np.asarray(row, float) for row in A]
    if len(rows) != s or any(len(row) > s or row[i:].any() for i, row in enumerate(rows)):
        raise ModelError(f"{who}: A must have {s} rows, one for each weight of b, with zeros on and above the diagonal")
    matrix = np.array([np.pad(row, (0, s - len(row))) for row in rows]).reshape(s, s)
    weights, c = np.asarray(b, float), matrix.sum(axis=1)
    _check_order(who, matrix, weights, order, order)
    full = np.pad(np.vstack([matrix, weights]), ((0, 0), (0, 1)))
    E = np.zeros((2, s + 1))
    if embedded is not None:
        if len(embedded) not in (s, s + 1):
            raise ModelError(f"{who}: embedded must have {s} or {s + 1} numbers, got {len(embedded)}")
        other = np.pad(np.asarray(embedded, float), (0, s + 1 - len(embedded)))
        _check_order(f"{who}, embedded", full, other, order - 1, order)
        E[0] = np.append(weights, 0.0) - other
    P = _cubic_hermite(who, weights, order) if dense is None else np.array(dense, float)
    sums = P.sum(axis=1) if P.ndim == 2 else P
    if P.ndim != 2 or len(P) != s + 1 or not np.allclose(sums, full[-1], rtol=0.0, atol=COEFFICIENT_TOLERANCE):
        raise ModelError(f"{who}: dense must have {s + 1} rows whose sums are the weights b, and 0")
    sizes = np.array([order, s, s + 1], np.int64)
    made = Tableau(full, np.append(c, 1.0), E, np.ascontiguousarray(P), np.zeros((2, s + 1)), sizes)
    known = TABLEAUX.get(name)
    if name in RESERVED_NAMES or (known is not None and not _equal_tableaux(known(), made)):
        raise ModelError(f"{who}: there is another method of that name; give it another")
    TABLEAUX[name] = lambda: made


RESERVED_NAMES = (*TABLEAUX, "auto", "radau", "generalised-alpha", "variational", "impulse")


def _check_order(who: str, A: np.ndarray, b: np.ndarray, order: int, most: int) -> None:
    """Raise an error if the weights do not satisfy the order conditions up to ``order``."""
    if not isinstance(most, int) or most < 1:
        raise ModelError(f"{who}: order must be a whole number from 1 on, got {most!r}")
    c = A.sum(axis=1)
    for name, value, of in itertools.chain.from_iterable(ORDER_CONDITIONS.get(k, []) for k in range(1, order + 1)):
        if not abs(of(A, b, c) - value) <= COEFFICIENT_TOLERANCE:
            raise ModelError(f"{who}: for order {order} {name} must be {value:.6g}, and is {of(A, b, c):.6g}")


def _cubic_hermite(who: str, b: np.ndarray, order: int) -> np.ndarray:
    """Cubic Hermite interpolation through the states and derivatives at both ends of a step."""
    if order > 4:
        raise ModelError(f"{who}: of an order above 4 give dense=..., as cubic interpolation would be less accurate")
    P = np.outer(np.append(b, 0.0), [0.0, 3.0, -2.0])
    P[0] += 1.0, -2.0, 1.0
    P[-1] += 0.0, -1.0, 1.0
    return P


def _equal_tableaux(a: Tableau, b: Tableau) -> bool:
    return all(x.shape == y.shape and (x == y).all() for x, y in zip(a, b, strict=True))
