"""Where a motion with contact begins: as described and assembled, or where an earlier result ended."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....contact.tables import Movers
from ....errors import ModelError
from ....math.vec import quaternion_matrix
from ....model.model import Model
from ....results.booked import added, ended
from ....results.result import Result
from ....tables.contact import Touching
from ...assemble import assemble
from ...assembly.start import Assembly
from ...compiled import compiled
from ..part import Part
from ..start import Start, begin, begin_at


def base_of(model: Model, t: float, parameters: Mapping[str, float] | None, before: Result | None) -> Assembly:
    """All single bodies at the start, in absolute coordinates.

    Raises
    ------
    ModelError
        If the earlier result is of another mechanism.
    """
    if before is None:
        return assemble(model, t=t, parameters=parameters)
    return begin(model, t, parameters, before, "absolute").base


def counted(result: Result, before: Result | None, part: Part) -> Result:
    """A result that counts on what an earlier one exchanged, but for that of a part of a motion."""
    if before is not None and not part.later:
        result.begun.done = ended(before)
        result.exchanged = added(result)
    return result


def part_of(base: Assembly, model: Model, parameters: Mapping[str, float] | None) -> Start:
    """The start of a model of some of the bodies, where ``base`` has them."""
    c, whole = compiled(model, parameters=parameters), base.compiled.structure
    s = c.structure
    q, v, z = np.zeros(s.nq), np.zeros(s.nv), c.z.copy()
    for name, b in s.place.items():
        if b >= 0:
            here, there, k = s.tables["tree"], whole.tables["tree"], whole.place[name]
            q[here.coordinates(b)] = base.q[there.coordinates(k)]
            v[here.velocities(b)] = base.v[there.velocities(k)]
    for name, k in s.state_at.items():
        if name in whole.state_at:
            z[k] = base.compiled.z[whole.state_at[name]]
    c.z = z
    return begin_at(Assembly(c, base.t, q, v), parameters, "absolute")


def place_sets(scene: Touching, M: Movers, before: Result) -> None:
    """Put sets of bodies where the earlier result left them.

    Raises
    ------
    ModelError
        If it has other ones.
    """
    names = [n for n in scene.carriers.names if n not in scene.carriers.single]
    for name in names:
        at, b = scene.carriers.slices[name], before.bulk.get(name)
        if b is None or len(b) != at.stop - at.start:
            raise ModelError(f"the result cannot be gone on with: it has no bodies {name!r}, or another number of them")
        M.pose[at, :3] = b.position[-1]
        M.pose[at, 3:] = np.stack(quaternion_matrix(*b.quaternion[-1].T), axis=1)
        M.twist[at, :3], M.twist[at, 3:] = b.velocity[-1], b.angular_velocity[-1]
