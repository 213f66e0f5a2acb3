"""Base class of controllers of a robot's joints, which know a model of the robot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import KW_ONLY
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BeforeValidator

from ..errors import ModelError
from ..model.controller import Controller, ControlState
from ..model.element import Law, Laws, Name, NamedNumbers, element, python_data
from ..model.expression_parser import DEFINED, DEFINITIONS, SyntaxNode
from ..model.expressions import number
from ..model.names import curve_parts
from ..model.units import split_quantity

if TYPE_CHECKING:
    from ..model.model import Model


def _as_list(value: Any) -> Any:
    """Return a list; a single law becomes a list of one."""
    return (value,) if isinstance(value, (str, int, float)) or callable(value) else python_data(value)


Coordinates = Annotated[tuple[str, ...], BeforeValidator(_as_list, json_schema_input_type=str | tuple[str, ...])]
JointLaws = Annotated[Laws, BeforeValidator(_as_list, json_schema_input_type=Law | Laws)]
DERIVATIVES = {"reference_rate": "reference", "reference_acceleration": "reference_rate"}
"""Laws that are, if not given, derivatives by time of others."""
SMOOTH = frozenset(("+", "-", "*", "/", "neg", "sin", "cos", "tanh", "exp"))
"""Operations without corners where they have a value."""
MAX_CACHED = 8  # controllers whose formulas are cached for each mechanism


@element
class JointController(Controller):
    """Controller of several joints, with a model of the robot: the mechanism's own bodies and joints.

    Its outputs are efforts along the coordinates. They have the names of the joints.
    """

    _: KW_ONLY
    coordinates: Coordinates
    reference: JointLaws
    kp: JointLaws
    kd: JointLaws
    reference_rate: JointLaws = ()
    base: Name | None = None
    ignored: tuple[Name, ...] = ()
    parameters: NamedNumbers = ()

    in_files: ClassVar[bool] = False

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return the joints' names; with the coordinate's name where a joint has several that are controlled."""
        own = f"{curve_parts(self.name)[0]}." if "." in self.name else ""
        named = [curve_parts(c) for c in self.coordinates]
        named = [(joint.removeprefix(own).replace(".", "_"), what) for joint, what in named]
        joints = Counter(joint for joint, _ in named)
        return tuple(joint if joints[joint] == 1 else f"{joint}_{what}" for joint, what in named)

    @property
    def referred(self) -> tuple[str, ...]:
        """Return the fields with one law for each coordinate, or one for all."""
        return ("reference", "kp", "kd", "reference_rate")

    def check(self, n: SimpleNamespace) -> None:
        """Refuse lists of the wrong length, coordinates given twice, and names that do not fit."""
        super().check(n)
        count = len(self.coordinates)
        if not count or len(set(self.coordinates)) < count:
            raise ModelError(f"{self.title}: coordinates names each coordinate once, at least one: {self.coordinates}")
        for name in self.referred:
            given = len(getattr(self, name))
            if given not in (1, count) and (given or name not in DERIVATIVES):
                raise ModelError(
                    f"{self.title}: {name} has {given} values for {count} coordinates; give one for each, or one "
                    f"for all"
                )

    def examine(self, model: Model) -> None:
        """Refuse coordinates, bodies and parameters that do not exist."""
        for text in self.coordinates:
            joint, what = curve_parts(text)
            model.joint(joint, self, what)
        for name in (*((self.base,) if self.base else ()), *self.ignored):
            model.body(name, self)
        env = model.environment()
        units = {k: (split_quantity(text) or ("", ""))[1] for k, text in env.written.items()}
        values = {k: number(x, env, units.get(k), f"parameter {k!r} of {self.title}") for k, x in self.parameters}
        model.environment(values)

    def given(self) -> dict[str, Any]:
        """Return the laws of every coordinate: "kp_0", "reference_0", its value "q_0" and its rate "v_0"."""
        out: dict[str, Any] = {}
        for k, text in enumerate(self.coordinates):
            out |= {f"q_{k}": text, f"v_{k}": f"{text}_rate"}
            for name in self.referred:
                if laws := getattr(self, name):
                    out[f"{name}_{k}"] = laws[k if len(laws) > 1 else 0]
        return out

    def called(self, given: str) -> str:
        """Return the field, and which of its values it is."""
        name, _, k = given.rpartition("_")
        return f"{name} of {self.coordinates[int(k)]!r}"

    def signals(self) -> dict[str, str]:
        """Return the efforts, then the errors."""
        efforts = {name: self.effort(k) for k, name in enumerate(self.output_names)}
        return efforts | {f"{name}_error": f"reference_{k} - q_{k}" for k, name in enumerate(self.output_names)}

    def effort(self, k: int) -> str:
        """Return the formula of the effort along coordinate k; "model_k" is the effort by the robot's model."""
        raise NotImplementedError

    def command(self, k: int) -> str | None:
        """Return the formula of the acceleration at which the model is evaluated; None: at rest."""
        return None

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """It has no states."""
        return ()

    def derived(self, name: str, wiring: Any) -> SyntaxNode | None:
        """Return a derivative of a reference, or the effort "model_k" by the robot's model."""
        from ..expression_graph.tracing import ACCELERATION, POSITION, RATE, joint_efforts, time_derivative

        what, _, k = name.rpartition("_")
        if what in DERIVATIVES:
            law = f"{DERIVATIVES[what]}_{k}"
            tree = wiring.template(self, law)
            return time_derivative(tree, wiring.model, f"{self.called(law)} of {self.title}", what)
        if what != "model":
            return None
        leaves: dict[str, SyntaxNode] = {}
        for i in range(len(self.coordinates)):
            leaves[f"{POSITION}[{i}]"] = wiring.template(self, f"q_{i}")
            if (command := self.command(i)) is not None:
                leaves[f"{RATE}[{i}]"] = wiring.template(self, f"v_{i}")
                leaves[f"{ACCELERATION}[{i}]"] = wiring.template(self, command)
        if not wiring.model.frozen:  # while it is described: what the effort depends on, without its formula
            return SyntaxNode("effort", tuple(leaves.values()))
        moving = self.command(0) is not None
        efforts = wiring.model.cache.get(
            "joint efforts", self, MAX_CACHED, lambda: joint_efforts(wiring.model, self, moving)
        )
        return with_leaves(efforts[int(k)], leaves, {"t", *wiring.model.parameters})


def with_leaves(tree: SyntaxNode, leaves: Mapping[str, SyntaxNode], still: Collection[str]) -> SyntaxNode:
    """Return the tree with other trees in place of some names.

    A tree that is used several times becomes a definition, which is computed once. The exceptions are trees with
    corners that depend on names other than ``still`` (time and parameters): the search for the side of such a corner
    does not look into definitions.
    """
    uses = Counter(n.value for n in tree.walk() if n.kind == "name")
    shared = [x for x, leaf in leaves.items() if uses[x] > 1 and leaf.args and _smooth_in_motion(leaf, still)]
    replacement = {**leaves, **{x: SyntaxNode(DEFINED, (), k) for k, x in enumerate(shared)}}
    parts = tree.args if tree.kind == DEFINITIONS else (tree,)
    placed = [_with_leaves(part, replacement, len(shared)) for part in parts]
    definitions = (*(leaves[x] for x in shared), *placed)
    return SyntaxNode(DEFINITIONS, definitions) if len(definitions) > 1 else definitions[0]


def _with_leaves(tree: SyntaxNode, leaves: Mapping[str, SyntaxNode], shift: int) -> SyntaxNode:
    """Replace names in one of the definitions, whose uses are renumbered by ``shift``."""
    if tree.kind == "name":
        return leaves.get(tree.value, tree)
    if tree.kind == DEFINED:
        return SyntaxNode(DEFINED, (), tree.value + shift)
    return tree.with_args(tuple(_with_leaves(a, leaves, shift) for a in tree.args))


def _smooth_in_motion(tree: SyntaxNode, still: Collection[str]) -> bool:
    """Whether all functions that may have corners depend only on the names ``still``."""
    uncertain = (n for n in tree.walk() if n.args and n.kind not in SMOOTH)
    return all(x.value in still for n in uncertain for x in n.walk() if x.kind == "name")
