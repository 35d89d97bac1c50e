"""What touch is worth to a policy: an object that was grasped anyhow is pressed on a wanted place of a skin.

python scripts/python_policy.py [--out docs/policy.png] [--seeds N] [--iterations N] [--jobs N] [--json]

The task is `spts.envs.PressEnv` with a peg that sits in the hand up to 15 mm off, nobody knows where. Every policy is
told the pose of the hand, the goal and the force on the hand, and moves the hand across the skin; the arm presses with
the wanted force by itself. They differ in what they are told of the touch. A linear policy is trained by its natural
gradient (Rajeswaran and others, 2017). The same seed gives the same numbers. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import pathlib
import tempfile

import gymnasium as gym
import numpy as np
import spts
import spts.envs

ROOT = pathlib.Path(__file__).resolve().parents[1]
ROWS, PITCH, M = 8, 0.01, 20
SLIP = 0.015
STEPS = 50
# episodes of an iteration, noise of its actions, and the divergence from policy to policy at
# first, which falls to none
EPISODES, NOISE, DIVERGENCE = 40, 0.5, 0.2
# discount, and that of the advantages
DISCOUNT, LAMBDA = 0.95, 0.95
RIDGE = 5e-3
# iterations between two tests, episodes of a test, and the seed of the first
EVERY, TESTS, FIRST = 5, 30, 1_000_000
ARMS = {
    "none": "no touch",
    "samples": f"{M} samples, rows that change",
    "repeated": f"{M} samples, rows that repeat",
    "image": f"image decoded of {M} samples",
    "pressure": "pressure of all taxels",
}


def repeating(folder):
    """The profile `as_built` with cells that repeat M rows of random weights: every window has the same rows."""
    codes = 255 * np.random.default_rng(0).integers(0, 2, M * ROWS * ROWS)
    path = pathlib.Path(folder) / "repeating.toml"
    built = (ROOT / "circuit/profiles/as_built.toml").read_text()
    path.write_text(f"patterns = {{ period = {M}, codes = {codes.tolist()} }}\n{built}")
    return str(path)


class Grasped(gym.Wrapper):
    """`PressEnv` whose object sits in the hand anyhow: the hand's pose is seen, the object's is not. The action is the
    velocity of the hand along x and y; along z it moves by its force.

    The observation is one vector: x and y of the hand, cm, its height, cm, x and y of the goal, cm, the share of the
    wanted force that acts, 1; the same again while something is touched, else zeros; and the touch. The reward is that
    of `PressEnv`, an error of the force counts as 2 at the most.
    """

    def __init__(self, arm, profile):
        observe = {"none": "pressure", "repeated": "samples"}.get(arm, arm)
        super().__init__(
            spts.envs.PressEnv(
                body=spts.Body.box((0.022, 0.022, 0.03)),
                skin=spts.Skin(ROWS, ROWS, PITCH),
                force=(2.0, 6.0),
                speed=0.1,
                dt=0.02,
                observe=observe,
                measurements=M,
                wire={"readout": profile} if arm == "repeated" else None,
            )
        )
        self.arm = arm
        size = {"none": 0, "samples": M, "repeated": M}.get(arm, ROWS * ROWS)
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (14 + size,), np.float64)

        self.action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)

    def reset(self, *, seed=None, options=None):
        seen, info = self.env.reset(seed=seed, options=options)
        self.slip = self.np_random.uniform(-SLIP, SLIP, 2)
        return self.seen(seen, info), info

    def step(self, action):
        # 0.05 mm a newton that lacks
        down = np.clip(0.025 * self.lacks, -1.0, 1.0)
        seen, _, done, cut, info = self.env.step((*action, -down))
        return self.seen(seen, info), -info["taxels_away"] - min(info["force_error"], 2.0), done, cut, info

    def seen(self, seen, info):
        goal, touched = seen["goal"], info["force"] > 0.0
        self.lacks = goal[2] - info["force"] if touched else np.inf
        force = min(info["force"] / goal[2], 3.0)
        hand = seen["position"] - (*self.slip, 0.0)
        others = np.array([*100 * hand, *100 * goal[:2], force, 1.0])
        others = np.concatenate([others, others * touched])
        if self.arm == "none":
            return others
        felt = seen["tactile"].ravel()
        # where, not how much: the force says that already
        size = np.linalg.norm(felt) if self.arm in ("samples", "repeated") else felt.sum()
        return np.concatenate([others, felt / size if size > 0.0 and touched else 0.0 * felt])


def episode(env, weights, seed, rng=None):
    """Observations (steps + 1, size), noise of the actions (steps, 2), rewards (steps,), whether it ended well, and the
    distance at its end, mm. Without `rng` there is no noise."""
    seen, info = env.reset(seed=seed)
    every, noises, rewards, done = [seen], [], [], False
    while len(rewards) < STEPS and not done:
        noise = np.zeros(2) if rng is None else NOISE * rng.standard_normal(2)
        seen, reward, done, _, info = env.step(np.clip(weights @ seen + noise, -1.0, 1.0))
        every.append(seen)
        noises.append(noise)
        rewards.append(reward)
    return np.array(every), np.array(noises), np.array(rewards), done, 1e3 * PITCH * info["taxels_away"]


def ridge(x, y):
    return np.linalg.solve(x.T @ x / len(x) + RIDGE * np.eye(x.shape[1]), x.T @ y / len(x))


def train(arm, seed, iterations, profile):
    """Tests of a policy while it learns: rows of steps, return, distance at the end, mm, and share of good ends."""
    env = Grasped(arm, profile)
    size = env.observation_space.shape[0]
    rng, weights, value, steps, tests = np.random.default_rng(seed), np.zeros((2, size)), None, 0, []
    for iteration in range(iterations + 1):
        if iteration % EVERY == 0:
            ends = [episode(env, weights, FIRST + k) for k in range(TESTS)]
            tests.append([steps, *np.mean([[sum(end[2]), end[4], end[3]] for end in ends], axis=0).tolist()])
        if iteration == iterations:
            break
        first = (seed * iterations + iteration) * EPISODES
        states, noises, advantages, returns = [], [], [], []
        for e in range(EPISODES):
            every, noise, rewards, done, _ = episode(env, weights, first + e, rng)
            worth = np.zeros(len(every)) if value is None else known(every) @ value
            worth[-1] *= not done
            surprise, advantage = rewards + DISCOUNT * worth[1:] - worth[:-1], np.zeros(len(rewards) + 1)
            for t in reversed(range(len(rewards))):
                advantage[t] = surprise[t] + DISCOUNT * LAMBDA * advantage[t + 1]
            states.append(every[:-1])
            noises.append(noise)
            advantages.append(advantage[:-1])
            returns.append(advantage[:-1] + worth[:-1])
        states, noises, advantages, returns = (np.concatenate(v) for v in (states, noises, advantages, returns))
        steps += len(states)
        value = ridge(known(states), returns)
        advantages = (advantages - advantages.mean()) / max(advantages.std(), 1e-9)
        # Fisher's matrix of a linear policy with normal noise is the covariance of what it sees
        change = ridge(states, noises * advantages[:, None])
        moved = 0.5 * np.mean(((states @ change) / NOISE) ** 2) * 2
        far = DIVERGENCE * (1.0 - iteration / iterations)
        weights = weights + np.sqrt(far / max(moved, 1e-12)) * change.T
    env.close()
    return tests


def known(states):
    """What the value of a state is linear in."""
    return np.concatenate([states, states[:, :14] ** 2], axis=1)


def run(job):
    return train(*job)


def band(values, seed=0):
    """Mean over the seeds, and its 95 % interval by the bootstrap: (3, ...)."""
    values = np.asarray(values)
    drawn = np.random.default_rng(seed).integers(len(values), size=(2000, len(values)))
    means = values[drawn].mean(axis=1)
    return np.stack([values.mean(axis=0), *np.quantile(means, (0.025, 0.975), axis=0)])


def draw(found, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for k, (arm, tests) in enumerate(found.items()):
        steps = tests[:, :, 0].mean(axis=0) / 1e3
        mean, low, high = band(tests[:, :, 1])
        axes.fill_between(steps, low, high, color=f"C{k}", alpha=0.25, linewidth=0)
        axes.plot(steps, mean, color=f"C{k}", label=ARMS[arm], marker="osD^v"[k], markersize=4, markevery=3)
    axes.set(xlabel="steps of training, thousands", ylabel="return of a test episode")
    axes.grid(axis="y", alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def main(arguments=None):
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", help="picture to draw (default: none)")
    options.add_argument("--seeds", type=int, default=5, help="trainings of every policy (default: 5)")
    options.add_argument("--iterations", type=int, default=60, help="iterations of a training (default: 60)")
    options.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes (default: the cores)")
    options.add_argument("--observe", default=",".join(ARMS), help="policies, of " + ",".join(ARMS) + " (default: all)")
    options.add_argument("--json", action="store_true", help="print the tests as JSON")
    chosen = options.parse_args(arguments)
    arms = chosen.observe.split(",")
    if chosen.seeds < 1 or chosen.iterations < 1 or chosen.jobs < 1 or not set(arms) <= set(ARMS):
        options.error("--seeds, --iterations or --jobs is below 1, or --observe names another policy")
    # sums in one order on any machine
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"))
    with tempfile.TemporaryDirectory() as folder:
        profile = repeating(folder)
        jobs = [(arm, seed, chosen.iterations, profile) for seed in range(chosen.seeds) for arm in arms]
        with multiprocessing.get_context("spawn").Pool(chosen.jobs) as pool:
            tests = pool.map(run, jobs, chunksize=1)
    found = {arm: np.array([t for (a, *_), t in zip(jobs, tests) if a == arm]) for arm in arms}
    if chosen.json:
        print(json.dumps({arm: tests.tolist() for arm, tests in found.items()}))
    else:
        print("| policy | steps of training | return | off at the end, mm | ended well |")
        print("|---|---|---|---|---|")
        for arm, tests in found.items():
            cells = ["{:.1f} ({:.1f} – {:.1f})", "{:.1f} ({:.1f} – {:.1f})", "{:.2f} ({:.2f} – {:.2f})"]
            ends = band(tests[:, -1, 1:]).T
            shown = " | ".join(cell.format(*end) for cell, end in zip(cells, ends))
            print(f"| {ARMS[arm]} | {tests[:, -1, 0].mean():,.0f} | {shown} |")
    if chosen.out:
        draw(found, chosen.out)


if __name__ == "__main__":
    main()
