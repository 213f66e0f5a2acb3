"""Whatever a user writes, messages stay readable, and laws without a value are named with the part that has none."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import flyball as fb

LONG = "+".join(["0.001*t"] * 150)  # as long as nesting allows
NAME = "x" * 20_000
MOST = 2000


def cart(*parts: fb.Element) -> fb.Mechanism:
    m = fb.Mechanism(planar=True)
    m.add(fb.Body("b", mass=1, inertia=1), fb.Prismatic("x", "ground", "b", at=(0, 0), axis=(1, 0)), *parts)
    return m


def with_law(law: object) -> Callable[[], object]:
    return lambda: cart(fb.Actuator("k", "x.displacement", force=law)).simulate(0.01)  # type: ignore[arg-type]


def many() -> object:
    m = cart(*(fb.Sensor(f"sensor_{i}", "x.displacement") for i in range(1000)))
    m.add(fb.Actuator("k", "x.displacement", force="sensr_7"))
    return m.simulate(0.01)


WRONG = {
    "name": with_law(f"{LONG} + unknwn + {LONG}"),
    "unit": with_law(f"{LONG} + (3 foo)*t + {LONG}"),
    "parenthesis": with_law(f"{LONG} + (t + {LONG}"),
    "nesting": with_law("sin(" * 1000 + "t" + ")" * 1000),
    "long": with_law("+".join(["t"] * 10_000)),
    "quantity": with_law(f"3 {NAME}"),
    "text": with_law(f"'{NAME}'"),
    "list": with_law(list(range(10_000))),
    "digits": with_law("9" * 20_000),
    "value": with_law(f"{LONG} + sqrt(0.005 - t)"),
    "sensors": many,
    "table": lambda: cart(fb.Table("y", x=range(10_000, 0, -1), y=range(10_000))),
    "table of texts": lambda: cart(fb.Table("y", x=range(10_000), y=["abc"] * 10_000)),
    "body": lambda: cart(fb.Body(NAME, mass=-1, inertia=1)),
    "method": lambda: cart().simulate(1, method=NAME),
    "part": lambda: cart()[NAME],
}


@pytest.mark.parametrize("what", WRONG)
def test_messages_are_short(what):
    with pytest.raises(fb.FlyballError) as e:
        WRONG[what]()
    assert len(str(e.value)) <= MOST


@pytest.mark.parametrize("text", [f'name = "{NAME}"\nplanar = "{NAME}"\n', f"{NAME} = 3\n", f'name = "{NAME}\n',
                                  f'[[bodies]]\nname = "a"\nmass = "3 {NAME}"\n'])  # fmt: skip
def test_messages_of_files_are_short(tmp_path, text):
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(fb.FlyballError) as e:
        fb.load(file)
    assert len(str(e.value)) <= MOST


def test_the_part_of_a_law_without_a_value_is_named():
    m = cart(fb.Actuator("k", "x.displacement", force="-5 - sqrt(value + 0.2)"))
    with pytest.raises(fb.SimulationError, match=r"sqrt\(value \+ 0.2\) is nan for \(?value \+ 0.2\)? = -\d"):
        m.simulate(1)
    m = cart(fb.State("p", rate="-1 - sqrt(p)", initial=0.1))
    with pytest.raises(fb.SimulationError, match=r"State 'p'.*sqrt\(p.value\) is nan for p.value = -\d"):
        m.simulate(1)


def test_what_runs_off_names_a_law_only_if_there_is_one():
    m = cart(fb.State("p", rate="1 + p**2"))
    with pytest.raises(fb.SimulationError, match=r"Look at the law of its rate, .*p\.value\*\*2"):
        m.simulate(2)
    m = cart(fb.Actuator("k", "x.displacement", force="1000*value**3 + rate**2 + 1"))
    with pytest.raises(fb.SimulationError, match=r"a velocity of joint 'x' .* Look at the laws of Actuator 'k'"):
        m.simulate(2)
