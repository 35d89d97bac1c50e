"""scripts/python_policy.py: policies with and without touch."""

import importlib
import json
import pathlib

import numpy as np
import pytest

PATH = pathlib.Path(__file__).parents[2] / "scripts/python_policy.py"


@pytest.fixture
def policy(monkeypatch):
    # where the processes that it starts find it, too
    monkeypatch.syspath_prepend(PATH.parent)
    return importlib.import_module("python_policy")


def by_hand(policy, env, sees):
    """Goes to the goal by where the hand is, and once it touches by what is felt, if it `sees` that."""
    weights = np.zeros((2, env.observation_space.shape[0]))
    for k in range(2):
        weights[k, k], weights[k, 3 + k] = -1.0, 1.0
        if sees:
            weights[k, 7 + k] = 1.0
            weights[k, 14:] = -100.0 * env.unwrapped.skin.positions[:, k]
    return [policy.episode(env, weights, seed) for seed in range(20)]


def test_the_task_needs_touch_and_no_more(policy):
    """The place is known to who feels, to every episode's good end, and to nobody else."""
    env = policy.Grasped("pressure", None)
    felt, blind = (by_hand(policy, env, sees) for sees in (True, False))
    assert all(done for *_, done, _ in felt)
    assert np.mean([done for *_, done, _ in blind]) < 0.5
    assert np.mean([rewards.sum() for _, _, rewards, *_ in felt]) > -30.0
    # without touch nothing else of the observation tells where the object is in the hand
    assert np.mean([off for *_, off in blind]) > 8.0


def test_a_policy_learns(policy, monkeypatch):
    monkeypatch.setattr(policy, "EPISODES", 20)
    monkeypatch.setattr(policy, "TESTS", 10)
    tests = np.array(policy.train("pressure", 0, 10, None))
    assert tests[-1, 1] > tests[0, 1] + 20.0, tests[:, 1]


def test_the_same_seed_is_the_same_policy(policy, capsys, tmp_path):
    """In this process and in another; and the picture."""
    picture = tmp_path / "policy.png"
    policy.main(["--seeds", "1", "--iterations", "1", "--observe", "repeated", "--json", "--out", str(picture)])
    own = policy.train("repeated", 0, 1, policy.repeating(tmp_path))
    assert json.loads(capsys.readouterr().out) == {"repeated": [own]}
    assert 0 < picture.stat().st_size < 200_000
    with pytest.raises(SystemExit):
        policy.main(["--observe", "smell"])
