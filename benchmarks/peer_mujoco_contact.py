"""MuJoCo on the scenes of contact: elliptic cones, its default and its stiff contacts, CG and Newton."""

from __future__ import annotations

import time

import contact_scenes as cs
import mujoco
import numpy as np

SOLVERS = {"Newton": mujoco.mjtSolver.mjSOL_NEWTON, "CG": mujoco.mjtSolver.mjSOL_CG}
CONTACT = {"soft": "", "stiff": 'solref="0.01 1" solimp="0.99 0.999 0.001"'}


def world(bodies: str, friction: float, contact: str, memory: str = "200M") -> str:
    """An MJCF file with a floor."""
    return f"""<mujoco><size memory="{memory}"/>
<option cone="elliptic" timestep="{cs.H}" gravity="0 0 -{cs.G}"/>
<default><geom friction="{friction} 0 0" condim="3" {CONTACT[contact]}/></default>
<worldbody><geom type="plane" size="0 0 1"/>{bodies}</worldbody></mujoco>"""


def geom(kind: str) -> str:
    """The shape of a body in a pile."""
    size = {
        "sphere": f"{cs.RADIUS}",
        "box": "{} {} {}".format(*cs.BOX),
        "capsule": "{} {}".format(*cs.CAPSULE),
        "cylinder": "{} {}".format(*cs.CYLINDER),
    }[kind]
    return f'<geom type="{kind}" size="{size}" density="{cs.DENSITY}"/>'


def text(values: np.ndarray) -> str:
    """Numbers for an attribute."""
    return " ".join(repr(float(x)) for x in values)


def pile(p: cs.Pile, contact: str) -> str:
    """A pile in its box."""
    walls = "".join(
        f'<geom type="plane" size="0 0 1" pos="{-p.half * x} {-p.half * y} 0" zaxis="{x} {y} 0"/>'
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
    )
    rows = zip(p.kind, p.position, p.quaternion, strict=True)
    bodies = "".join(f'<body pos="{text(x)}" quat="{text(e)}"><freejoint/>{geom(kind)}</body>' for kind, x, e in rows)
    return world(walls + bodies, cs.PILE_FRICTION, contact, "6G")


def stack(s: cs.Stack, contact: str) -> str:
    """A stack on the floor."""
    rows = zip(s.mass, s.position, s.yaw, strict=True)
    bodies = "".join(
        f'<body pos="{text(x)}" euler="0 0 {np.degrees(a)}"><freejoint/>'
        f'<geom type="box" size="0.5 0.5 0.5" mass="{m}"/></body>'
        for m, x, a in rows
    )
    return world(bodies, cs.STACK_FRICTION, contact)


class Run:
    """An engine at work on a scene."""

    def __init__(self, xml: str, solver: str) -> None:
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.model.opt.solver = SOLVERS[solver]
        self.data = mujoco.MjData(self.model)

    def step(self) -> float:
        """One step; its CPU seconds."""
        began = time.process_time()
        mujoco.mj_step(self.model, self.data)
        return time.process_time() - began

    def figures(self) -> dict[str, float]:
        """Contacts, deepest overlap [mm], kinetic energy [J]."""
        d = self.data
        momentum = np.zeros(self.model.nv)
        mujoco.mj_mulM(self.model, d, momentum, d.qvel)
        return {
            "contacts": int(d.ncon),
            "overlap": float(-1e3 * np.min(d.contact.dist[: d.ncon], initial=0.0)),
            "kinetic": float(0.5 * momentum @ d.qvel),
        }

    def centres(self) -> np.ndarray:
        """Centres of the bodies [m]."""
        return self.data.xpos[1:].copy()
