"""A cart that balances its pole as a Gymnasium environment, for libraries of reinforcement learning.

`m.stepper` advances the mechanism by one control period at a time. Run it with ``python examples/cart_pole_gym.py``: it
checks the environment by Gymnasium's own checker, and measures steps per second with a linear feedback in place of a
learned policy. It needs the package gymnasium (``pip install "flyball[gym]"``).
"""

import time
from typing import Any

import gymnasium
import numpy as np

import flyball as fb

CART, POLE, HALF_LENGTH = 1.0, 0.1, 0.5  # kg, kg, m
LARGEST_FORCE, RAIL, LARGEST_ANGLE = 10.0, 2.4, np.radians(12)  # N, m, rad
LEAN = np.radians(2)  # rad: how the pole is drawn
FEEDBACK = np.array([1.0, 2.0, -30.0, -8.0])  # N/m, N s/m, N/rad, N s/rad; the angle is positive to the left


def mechanism() -> fb.Mechanism:
    """Cart and pole, which leans a little (Barto, Sutton and Anderson 1983), without friction."""
    m = fb.Mechanism("cart and pole", planar=True, gravity=(0, -9.81))
    m.add(fb.Body("cart", mass=CART, inertia=0.01, shape=fb.Box(edges=(0.4, 0.2, 0.2))))
    pole = fb.Box(edges=(0.04, 2 * HALF_LENGTH, 0.04))
    centre = (-HALF_LENGTH * np.sin(LEAN), HALF_LENGTH * np.cos(LEAN))
    inertia = POLE * HALF_LENGTH**2 / 3
    m.add(fb.Body("pole", mass=POLE, inertia=inertia, position=centre, angle=LEAN, shape=pole))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "pole", at=(0, 0), angle=LEAN))
    m.add(fb.Actuator("push", "rail.displacement", force="0"))
    return m


class CartPole(gymnasium.Env):
    """Force on the cart as action; displacement, speed, angle and angular speed as observation; 1 for every step."""

    def __init__(self) -> None:
        state = ["rail.displacement", "rail.displacement_rate", "pin.angle", "pin.angle_rate"]
        self.sim = mechanism().stepper("20 ms", inputs=["push"], outputs=state)
        self.action_space = gymnasium.spaces.Box(-1, 1, (1,), np.float32)
        limits = np.array([2 * RAIL, 20.0, 3 * LARGEST_ANGLE, 20.0])  # m, m/s, rad, rad/s
        self.observation_space = gymnasium.spaces.Box(-limits, limits, dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """Start near the upright position."""
        super().reset(seed=seed)
        x, v, angle, spin = self.np_random.uniform(-0.05, 0.05, 4)
        return self.sim.reset({"rail.displacement": (x, v), "pin.angle": (angle, spin)}), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Apply the action for one control period."""
        y = self.sim.step(LARGEST_FORCE * np.asarray(action, float))
        return y, 1.0, bool(abs(y[0]) > RAIL or abs(y[2]) > LARGEST_ANGLE), False, {}


def balance(env: CartPole, steps: int) -> int:
    """Steps until the pole falls, at most ``steps``, with a linear feedback."""
    y, _ = env.reset(seed=0)
    for k in range(steps):
        y, _, fallen, _, _ = env.step(np.clip([FEEDBACK @ y / LARGEST_FORCE], -1, 1))
        if fallen:
            return k + 1
    return steps


if __name__ == "__main__":
    from gymnasium.utils.env_checker import check_env

    env = CartPole()
    check_env(env)
    began = time.perf_counter()
    n = balance(env, 5000)
    print(f"balanced for {n} steps, {n / (time.perf_counter() - began):,.0f} steps per second")
