"""Options are written once: on the methods of `Mechanism`, from which come the analyses' objects and the subcommands."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import json
import pkgutil
import re

import pytest
import typer.main
from typer.testing import CliRunner

import flyball
import flyball as fb
from flyball.analysis_options import AnalysisOptions
from flyball.cli import app
from flyball.docstrings import argument_help, first_doc_line
from flyball.mechanism_methods import DesignMethods, MobilityMethods, MotionMethods, StaticsMethods
from flyball.numerics.integrators.butcher_tableaux import TABLEAUX
from flyball.sensitivity import sensitivity
from flyball.simulation.method_choice import AUTO_METHOD, IMPLICIT_METHODS, IMPULSE_METHOD
from flyball.studies import study
from flyball.studies.sampling import LISTED_DESIGNS, SAMPLED_DESIGNS
from flyball.symbolic.export import LANGUAGES

FAMILIES = (MotionMethods, StaticsMethods, DesignMethods, MobilityMethods)
METHODS = {name: f for c in FAMILIES for name, f in vars(c).items() if inspect.isfunction(f)}
COMMANDS = typer.main.get_command(app).commands
NOT_COMMANDS = {
    "assemble",
    "fit",
    "mass_properties",
    "prepare",
    "stepper",
}  # `check` tells two; what is prepared is for Python
SHARED = {"model", "change", "as_json", "help"}
ELSEWHERE = {  # arguments that do not stand on the command line, or otherwise
    "parameters": "--set",
    "progress": "a bar unless --json or --quiet",
    "minimize": "a function",
    "executor": "an object",
}
NOT_FILED = {("equilibrium", "start"), ("equilibria", "start")}  # equilibria have no files
OTHERWISE = {("singularities", "branch")}  # by its number in the table, of a second search


def option_classes() -> dict[str, type[AnalysisOptions]]:
    for module in pkgutil.walk_packages(flyball.__path__, "flyball."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)

    def below(c: type) -> list[type]:
        return [c, *(d for s in c.__subclasses__() for d in below(s))]

    return {c.__name__: c for c in below(AnalysisOptions)}


CLASSES = option_classes()


def arguments(method) -> dict[str, inspect.Parameter]:
    return {k: p for k, p in inspect.signature(method).parameters.items() if k != "self"}


@pytest.mark.parametrize("name", METHODS)
def test_every_argument_of_a_method_is_a_field_and_has_its_line(name):
    method = METHODS[name]
    asked = arguments(method)
    assert all(p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) for p in asked.values()), "no **options"
    assert all(p.annotation not in (p.empty, "Any", "object") or k in ("target", "weights") for k, p in asked.items())
    cls = re.search(r"(\w+Options)\.from_arguments\(locals\(\)\)", inspect.getsource(method))
    if cls is not None:
        fields = dataclasses.fields(CLASSES[cls[1]])
        assert {f.name for f in fields} == set(asked)
        assert all(f.default is f.default_factory is dataclasses.MISSING for f in fields), "defaults are the method's"
        assert CLASSES[cls[1]].__dataclass_params__.frozen
    else:
        assert not asked
    told = argument_help(method)
    assert list(told) == list(asked)
    assert all(t.text.endswith(".") for t in told.values())
    assert first_doc_line(method).endswith((".", "y = C x + D u."))
    for k, t in told.items():
        if t.choices and isinstance(asked[k].default, str):
            assert asked[k].default in t.choices, f"the documented choices of {k} include its default"
    assert "Returns\n-------" in inspect.getdoc(method)


METHODS_OF_INTEGRATION = {*TABLEAUX, *IMPLICIT_METHODS, IMPULSE_METHOD, AUTO_METHOD}
CHOICES = {  # method and argument -> the registry of what it accepts
    ("simulate", "method"): METHODS_OF_INTEGRATION,
    ("study", "method"): METHODS_OF_INTEGRATION,
    ("compare", "method"): set(TABLEAUX),
    ("study", "analysis"): set(study.ANALYSES),
    ("study", "design"): {*LISTED_DESIGNS, *SAMPLED_DESIGNS},
    ("sensitivity", "analysis"): set(sensitivity.ANALYSES),
    ("optimize", "analysis"): set(sensitivity.ANALYSES),
    ("export", "language"): set(LANGUAGES),
}


@pytest.mark.parametrize(("name", "argument"), CHOICES)
def test_the_choices_of_an_argument_are_those_of_its_registry(name, argument):
    """The help of the command line and the documentation are made from the docstring."""
    described = argument_help(getattr(fb.Mechanism, name))[argument]
    assert set(described.choices) == CHOICES[name, argument]


def test_mechanisms_have_every_method_with_its_signature():
    for name, method in METHODS.items():
        assert inspect.signature(getattr(fb.Mechanism, name)) == inspect.signature(method)
    shown = str(inspect.signature(fb.Mechanism("m").simulate))
    for part in ("rtol: 'float' = 1e-07", "method: 'str | Stepping' = 'auto'", "-> 'Result'"):
        assert part in shown


@pytest.mark.parametrize("name", sorted(set(METHODS) - NOT_COMMANDS))
def test_every_argument_is_an_option_of_the_subcommand(name):
    command = COMMANDS["run" if name == "simulate" else name.replace("_", "-")]
    there = {p.name for p in command.params}
    missing = {
        k for k in arguments(METHODS[name]) if k not in there and k not in ELSEWHERE and (name, k) not in NOT_FILED
    }
    assert missing == set()
    assert SHARED - {"help"} <= there


def test_what_a_method_does_not_have_is_refused_by_name():
    m = fb.Mechanism("m")
    with pytest.raises(TypeError, match=r"^Mechanism\.simulate\(\) got an unexpected keyword argument 'rtoll'"):
        m.simulate(1.0, rtoll=1e-3)  # type: ignore[call-arg]


def test_nothing_to_stabilise():
    m = fb.Mechanism("stone", planar=True)
    m.add(fb.Body("b", mass=1, inertia=1))
    with pytest.raises(fb.ModelError, match=r"has no effect: there are no constraints to stabilise; leave it out$"):
        m.simulate(1.0, coordinates="absolute", stabilization="none")


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda m: m.simulate(1.0, alpha=3.0), "alpha is a rate of stabilization='baumgarte'"),
        (lambda m: m.simulate(1.0, stabilization="none"), "stabilization='none' has no effect: in joint coordinates"),
        (
            lambda m: m.compare(1.0, formulations=["projection"], alpha=3.0),
            "alpha is a rate of the formulation 'baumgarte'",
        ),
        (lambda m: m.modes(about=m.equilibrium(), frozen=True), "frozen applies to a motion; it has no effect"),
        (lambda m: m.root_locus("k", [1, 2], equilibrium=True, frozen=True), "frozen has no effect at an equilibrium"),
        (lambda m: m.simulate(1j), "t_end is a time"),
        (lambda m: m.simulate("1 m"), "t_end: '1 m': expected a time"),
        (lambda m: m.simulate(1, parameters=5), "parameters maps names to values"),
        (
            lambda m: m.simulate(1, parameters={"k": "2 kg"}),
            "parameter 'k' of 'oscillator' is '100 N/m'; '2 kg': expected",
        ),
        (lambda m: m.simulate(1, progress="yes"), "progress is True, False or a function"),
        (lambda m: m.simulate(1, start=3), "start is a result"),
        (lambda m: m.simulate(1, start=m.simulate(0.1), t_start=0), "leave out t_start"),
        (lambda m: m.simulate(1, max_steps=0.5), "max_steps must be a whole number"),
        (lambda m: m.simulate(1, max_step="0 s"), "max_step must be greater than 0"),
        (lambda m: m.modes(frozen="yes"), "frozen is True or False"),
        (lambda m: m.modes(about=m.simulate(0.1), t=1), "t = 1 s is no output time of the motion"),
        (lambda m: m.sensitivity(["b.x"], ["k"], t_end=1), "t_end applies to a motion"),
        (lambda m: m.sensitivity(["b.x"], ["k"], rtol=1e-3), "rtol applies to a motion"),
        (lambda m: m.sensitivity(["b.x"], ["k"], about="equilibrium"), "about is for modes"),
        (lambda m: m.optimize(["b.x"], ["k"], minimize=sum, weights=2), "with minimize they have no effect"),
        (lambda m: m.optimize(["b.x"], ["k"], target=[0], evaluations=0), "evaluations must be at least 1"),
        (lambda m: m.root_locus("k", [1, 2], about=m.simulate(0.1), equilibrium=True), "give either about or"),
        (lambda m: m.linearize(inputs="k"), "inputs is a list of names"),
        (lambda m: m.equilibrium(preload="f"), "preload is a list of names"),
    ],
)
def test_options_that_make_no_sense_or_do_nothing_are_refused(ask, told):
    with pytest.raises(fb.ModelError, match=told):
        ask(oscillator())


def oscillator() -> fb.Mechanism:
    m = fb.Mechanism("oscillator", planar=True, parameters={"k": "100 N/m", "c": 0.0})
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=(0.1, 0)))
    m.add(fb.Prismatic("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(fb.CoordinateSpring("spring", coordinate="slide.displacement", stiffness="k", damping="c"))
    return m


def test_subcommands_pass_options_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    oscillator().save("m.toml")
    words = ["run", "m.toml", "--t-end", "1", "--max-step", "5 ms", "--stabilization", "baumgarte", "--alpha", "20"]
    said = CliRunner().invoke(
        app, [*words, "--coordinates", "absolute", "--outputs", "0:1:3", "--no-plots", "--no-animation", "--quiet"]
    )
    assert said.exit_code == 0, said.stderr
    r = fb.load_result("m-result/result.nc")
    assert r.t.tolist() == [0, 0.5, 1]
    assert r.health.steps >= 200
    assert {k: r.health.options[k] for k in ("max_step", "alpha", "beta")} == {
        "max_step": 0.005,
        "alpha": 20,
        "beta": 10,
    }
    on = CliRunner().invoke(
        app,
        [
            "run",
            "m.toml",
            "--start",
            "m-result/result.nc",
            "--t-end",
            "2",
            "--quiet",
            "--out",
            "on",
            "--no-plots",
            "--no-animation",
        ],
    )
    assert on.exit_code == 0, on.stderr
    assert fb.load_result("on/result.nc").t[[0, -1]].tolist() == [1, 2]


def test_series_and_loci_are_subcommands(tmp_path, monkeypatch):
    """omega = sqrt(k / m); damping c moves the eigenvalues to -c/2."""
    monkeypatch.chdir(tmp_path)
    oscillator().save("m.toml")
    said = CliRunner().invoke(
        app, ["root-locus", "m.toml", "c", "--values", "1:1.8:5", "--equilibrium", "--plot", "l.png", "--json"]
    )
    assert said.exit_code == 0, said.stderr
    data = json.loads(said.stdout)
    assert [w[0] for w in data["eigenvalues"][0]] == pytest.approx([-0.5, -0.5])
    assert (tmp_path / "l.png").stat().st_size > 10_000
    none = CliRunner().invoke(app, ["root-locus", "m.toml", "c", "--values", "-1:1:5"])
    assert none.exit_code == 2
    assert "must be zero or greater" in none.stderr
    said = CliRunner().invoke(app, ["equilibria", "m.toml", "k", "--values", "1,2 N/m,3", "--plot", "s.png"])
    assert said.exit_code == 0, said.stderr
    assert "stable" in said.stdout
    bad = CliRunner().invoke(app, ["equilibria", "m.toml", "k", "--values", "1:2"])
    assert bad.exit_code == 2
    assert "first:last:how many" in bad.stderr
