"""What is printed computes what the graph says, in every language, at all that a function meets."""

import ctypes
import shutil
import subprocess
import sys

import numpy as np
import pytest

from flyball.errors import ModelError
from flyball.expression_graph.graph import Graph, Symbol, evaluate, jacobian
from flyball.expression_graph.printers import routines as limits
from flyball.expression_graph.printers.c import c_sources
from flyball.expression_graph.printers.casadi import casadi_function
from flyball.expression_graph.printers.numba import numba_module
from flyball.expression_graph.printers.python import python_functions, python_module
from flyball.expression_graph.printers.routines import Argument, Routine
from flyball.math import scalar
from flyball.math.spline import pack_spline

STRICT = ["-Wall", "-Wextra", "-std=c99", "-pedantic", "-Werror", "-O1"]


def every_operation(x, y):
    one = ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "sinh", "cosh", "tanh", "absolute", "sign", "rounded"]
    made = [getattr(scalar, n)(z) for n in one for z in (x, -y, x * y - 0.25)]
    made += [
        getattr(scalar, n)(a, b) for n in ("atan2", "minimum", "maximum") for a, b in ((x, y), (-x, x), (y, y * x))
    ]
    made += [scalar.choose(x - y, -x, y * 2.0), scalar.choose(-x, 1.0, x), (x * x + 0.1) ** y]
    made += [scalar.sqrt(x), scalar.log(y), 1.0 / x, -x / -y, (x - y) / (-2.5 * x), -(x + y) - (x - y) * (y - x)]
    return [
        *made,
        x - (y - (x - 3.0)),
        x * (y * (x * 1e-300)),
        (x / y) * (y / 3.0),
        1 / 3 + x,
        5e-324 * x + 1e22,
        -x,
        2.0,
    ]


def table(g, x, beyond="line", moved=()):
    points = np.array([-1.0, -0.3, 0.2, 1.0, 1.7])
    pieces = np.arange(16.0).reshape(4, 4) - 7.0
    data = [float(v) for v in pack_spline(points, np.arange(5.0), pieces, beyond)]
    for k, node in moved:
        data[k] = node
    return [x_ for x_ in g.table(np.array(data, object), 0, x)]


def routine():
    g = Graph()
    t, x, y, p = g.symbol("t"), g.symbol("x"), g.symbol("y"), g.symbol(Symbol("mass", "parameter", unit="kg"), 2.0)
    made = every_operation(x, y)
    tables = [v for b in ("hold", "line", "repeat", "refuse") for v in table(g, 2.0 * x, b)]
    tables += table(g, y, "line", [(9, p), (11, p * 0.5)])
    third = jacobian([tables[2], tables[5]], [x])[:, 0]
    M = np.array([[t * x, y], [p, x * y + p]], object)
    results = {"made": np.array(made, object), "tables": np.array([*tables, *third], object), "M": M, "lone": t - p}
    arguments = [
        Argument("t", t, "time"),
        Argument("double", [x, y], "state"),
        Argument("p", [p], "parameters", (2.0,)),
    ]
    return Routine("of_all", arguments, results, "Everything.", {"M": "a matrix"})


@pytest.fixture(scope="module")
def all_of_it():
    return routine()


def states():
    special = [0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -0.6, 3.4, -7.25, np.inf, -np.inf, np.nan]
    return [(0.3, (x, y), (1.5,)) for x in special for y in special]


def expected(r, t, q, p):
    values = {"t": t, "x": q[0], "y": q[1], "mass": p[0]}
    with np.errstate(all="ignore"):
        return np.array(evaluate(r.nodes, values), float)


def flat(results):
    return np.concatenate([np.ravel(x) for x in results])


def test_numpy(all_of_it):
    r = all_of_it
    f = python_functions([r])["of_all"]
    for t, q, p in states():
        np.testing.assert_allclose(flat(f(t, q, p)), expected(r, t, q, p), rtol=4e-15, equal_nan=True)
    np.testing.assert_array_equal(f(0.1, (0.2, 0.3))[2], f(0.1, (0.2, 0.3), (2.0,))[2])
    t, q, p = (np.array(x) for x in zip(*states()))
    wide = f(t, q, p)
    assert wide[2].shape == (len(t), 2, 2) and wide[3].shape == (len(t),)
    np.testing.assert_allclose(wide[0][5], f(t[5], q[5], p[5])[0], rtol=4e-15)
    np.testing.assert_allclose(wide[1][17], f(t[17], q[17], p[17])[1], rtol=4e-15)
    assert f(0.3, q.reshape(12, 12, 2))[2].shape == (12, 12, 2, 2)
    with pytest.raises(ValueError, match="double has 2 numbers"):
        f(0.0, (1.0, 2.0, 3.0))


def test_the_module_needs_numpy_only(all_of_it, tmp_path):
    (tmp_path / "made.py").write_text(python_module([all_of_it], 'Head with "quotes" and a \\ in it.'))
    program = "import made, sys; print(made.of_all(0.1, (0.2, 0.3))[3], [m for m in sys.modules if 'flyball' in m or 'numba' in m])"
    out = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert out.stdout.split() == ["-1.9", "[]"]


def compiled(tmp_path, sources, name):
    if shutil.which("gcc") is None:
        pytest.skip("there is no gcc here")
    (tmp_path / f"{name}.c").write_text(sources.source)
    (tmp_path / f"{name}.h").write_text(sources.header)
    subprocess.run(
        ["gcc", *STRICT, "-shared", "-fPIC", f"{name}.c", "-o", f"{name}.so", "-lm"], cwd=tmp_path, check=True
    )
    return ctypes.CDLL(str(tmp_path / f"{name}.so"))


def c_call(function, r, given):
    """Results of a C function of numbers and arrays."""
    arrays = [np.array(x, float) for x in given]
    out = [np.full(a.shape, 7.0) for a in r.arrays.values()]
    pointers = [ctypes.c_double(float(a)) if a.ndim == 0 else a.ctypes.data_as(ctypes.c_void_p) for a in arrays]
    function(*pointers, *[x.ctypes.data_as(ctypes.c_void_p) for x in out])
    return out


def test_c(all_of_it, tmp_path):
    r = all_of_it
    library = compiled(tmp_path, c_sources([r], "made", "Head */ of it."), "made")
    for t, q, p in states():
        np.testing.assert_array_equal(flat(c_call(library.made_of_all, r, (t, q, p))), expected(r, t, q, p))


def test_numba(all_of_it):
    r, space = all_of_it, {}
    exec(numba_module([r], "Head."), space)
    for t, q, p in states():
        found = space["of_all"](t, np.array(q), np.array(p))
        np.testing.assert_allclose(flat(found), expected(r, t, q, p), rtol=4e-15)


def test_casadi_with_exact_derivatives(all_of_it):
    ca = pytest.importorskip("casadi")
    r = all_of_it
    f = casadi_function(r)
    for t, q, p in states():
        if not np.isfinite(q).all():
            continue
        found = np.concatenate([np.array(x.full()).ravel() for x in f(t, q, p)])
        np.testing.assert_allclose(found, expected(r, t, q, p), rtol=4e-15)
    J = ca.Function("J", [*f.sx_in()], [ca.jacobian(ca.vertcat(*f(*f.sx_in())[:2]), f.sx_in(1))])
    at = (0.3, (0.41, 0.87), (1.5,))
    ours = jacobian([*r.results["made"], *r.results["tables"]], r.arguments[1].nodes)
    own = np.array(evaluate(list(ours.ravel()), {"t": 0.3, "x": 0.41, "y": 0.87, "mass": 1.5}), float)
    np.testing.assert_allclose(J(*at).full().ravel(), own, rtol=1e-13, atol=1e-290)
    q = ca.MX.sym("q", 2)
    assert ca.Function("g", [q], [f(0.3, q, 1.5)[3]])((0.0, 0.0)) == pytest.approx(-1.2)


def called():
    g = Graph()
    x = g.symbol("x")
    return Routine("force", [Argument("x", x)], {"F": x.called(lambda x: 3.0 * x, x) + x.called(np.cbrt, x)})


def test_python_functions_are_handed_over():
    r = called()
    space = {}
    exec(python_module([r], "Head."), space)
    with pytest.raises(ValueError, match=r"first say what the function lambda_2 is: use\(lambda_2=\.\.\.\)"):
        space["force"](8.0)
    names = list(space["FUNCTIONS"])
    space["use"](**dict(zip(names, (lambda x: 3.0 * x, np.cbrt))))
    assert space["force"](8.0) == 26.0
    np.testing.assert_array_equal(space["force"](np.array([8.0, 0.0])), [26.0, 0.0])
    with pytest.raises(ValueError, match="no function wind"):
        space["use"](wind=abs)
    assert python_functions([r])["force"](8.0) == 26.0


@pytest.mark.parametrize(
    ("language", "printer"),
    [("C", lambda r: c_sources([r], "m", "")), ("CasADi", casadi_function), ("Numba", lambda r: numba_module([r], ""))],
)
def test_python_functions_are_refused_by_name(language, printer):
    if language == "CasADi":
        pytest.importorskip("casadi")
    with pytest.raises(ModelError, match=f"is a Python function, and force calls it: {language} supports"):
        printer(called())


def test_what_is_shared_is_computed_once():
    g = Graph()
    x = g.symbol("x")
    y = scalar.sin(x + 1.0)
    for _ in range(30):
        y = y * y + y
    r = Routine("f", [Argument("x", x)], {"y": y})
    assert r.operations == 62
    text = python_module([r], "")
    assert text.count("np.sin(") == 1 and text.count(" * ") == 30
    assert len(text) < 4000


def test_what_is_too_large_or_has_no_argument_is_refused(monkeypatch):
    g = Graph()
    x, y = g.symbol("x"), g.symbol("wind")
    with pytest.raises(ModelError, match="f depends on wind, which is no argument"):
        python_module([Routine("f", [Argument("x", x)], {"y": x + y})], "")
    monkeypatch.setattr(limits, "MAX_OPERATIONS", 3)
    with pytest.raises(ModelError, match="f takes 4 operations, and straight-line code is written up to 3"):
        c_sources([Routine("f", [Argument("x", x)], {"y": ((x + 1.0) * x + 1.0) * x})], "m", "")
