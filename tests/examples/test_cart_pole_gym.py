"""The environment of reinforcement learning passes Gymnasium's own checker, and a known feedback balances the pole."""

import runpy

import pytest

from tests.mechanisms import EXAMPLES

pytest.importorskip("gymnasium", reason="the environment needs Gymnasium: pip install 'flyball[gym]'")


@pytest.mark.filterwarnings("ignore")
def test_the_environment_is_sound():
    from gymnasium.utils.env_checker import check_env

    example = runpy.run_path(str(EXAMPLES / "cart_pole_gym.py"))
    env = example["CartPole"]()
    check_env(env)
    assert example["balance"](env, 300) == 300
    env.reset(seed=1)
    falls = [env.step([0.0])[2] for _ in range(200)]
    assert any(falls) and not falls[5]
