"""A force of one's own: the air's drag and the Magnus force on a football that spins, as a class in this file.

Run it with ``flyball run examples/own_force.py --t-end 1.5 --out out``, or as it is: it tests the class first.
"""

from __future__ import annotations

from typing import Annotated

import flyball as fb
from flyball.elements import BodyForce, Number, Unit, element, nonnegative
from flyball.math.vec import add, cross, norm, scale


@element
class Air(BodyForce):
    """Drag against the velocity v of a ball, and the Magnus force of its angular velocity w: -c |v| v + s w x v.

    Parameters
    ----------
    drag : number [N s^2/m^2]
    lift : number [N s^2/m]
    """

    drag: Annotated[Number, Unit("N*s^2/m^2")] = 0.0
    lift: Annotated[Number, Unit("N*s^2/m")] = 0.0

    @staticmethod
    def wrench(par, F, M, laws, values):
        """Force and torque on the ball's frame M: position, rotation, angular velocity, velocity, accelerations."""
        drag, lift = par[0], par[1]
        w, v = M[2], M[3]
        none = 0.0 * drag
        return add(scale(-drag * norm(v), v), scale(lift, cross(w, v))), (none, none, none)

    def check(self, n):
        """Neither is negative."""
        nonnegative(self, n, "drag", "lift")

    def parameters(self, n, separation):
        """Numbers that the formula is given, in SI units."""
        return (n.drag, n.lift)


def mechanism() -> fb.Mechanism:
    """A free kick: 430 g, 22 cm wide, kicked at 30 m/s with 10 turns a second."""
    m = fb.Mechanism(
        "free kick", gravity=(0, 0, -9.81), parameters={"drag": "0.0056 N*s^2/m^2", "lift": "0.0014 N*s^2/m"}
    )
    ball = fb.Body(
        "ball",
        mass="430 g",
        inertia=(0.0035, 0.0035, 0.0035),
        position=(0, 0, "11 cm"),
        velocity=(28, 0, 10),
        angular_velocity=(0, 0, "10 turn/s"),
    )
    m.add(ball, Air("air", "ball", drag="drag", lift="lift"))
    return m


if __name__ == "__main__":
    print("checked:", ", ".join(fb.testing.check_element(Air("air", "ball", drag=0.0056, lift=0.0014))))
    run = mechanism().simulate(1.5)
    print(run)
    print("the ball is turned aside by", round(float(run["ball.y"][-1]), 2), "m")
