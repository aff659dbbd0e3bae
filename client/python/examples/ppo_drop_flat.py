"""PPO of Stable-Baselines3 learns DropFlat: to lay a hanging sheet down flat where its lowest row hangs.

ppo_drop_flat.py OUT [--steps N] [--seed S] [--envs N] [--side N]

Writes OUT.csv (normalized performance of the learner, its action without noise, on starts it does not train on) and,
with matplotlib, OUT.png: the learning curve beside the policy by hand and random actions. Needs the extra `sb3`; one
seed gives one curve on one machine.
"""

import argparse
import csv
import importlib.util
import time

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import drape
from drape.gym import DropFlat, scripted
from drape.gym.sb3 import StableVecEnv

JUDGED = 16  # episodes
JUDGE_SEED = 1_000_000  # far from those that are trained on


def make(client, envs, side):
    # In the frame of the start the target is at the same place in all episodes, so what is seen suffices.
    return DropFlat(envs, client=client, side=side, frame="start", autoreset_mode="SameStep")


def play(env, act):
    """normalized_performance [JUDGED] at the end of one episode. act(observation): actions."""
    observation, _ = env.reset(seed=JUDGE_SEED)
    ended = False
    while not ended:
        observation, _, terminated, truncated, info = env.step(act(observation))
        ended = (terminated | truncated).all()
    return info["final_info"]["normalized_performance"]


class Judge(BaseCallback):
    """Plays JUDGED episodes every `every` steps, before the learner takes its next."""

    def __init__(self, env, every, rows):
        super().__init__()
        self.env, self.every, self.rows = env, every, rows
        self.begin, self.next = time.perf_counter(), 0

    def _on_rollout_start(self):
        if self.num_timesteps < self.next:
            return
        self.next = self.num_timesteps + self.every
        stable = StableVecEnv(self.env)

        def act(observation):
            seen = self.training_env.normalize_obs(observation)
            stable.step_async(self.model.predict(seen, deterministic=True)[0])
            return stable._actions.astype(np.float32)

        scores = play(self.env, act)
        noisy = [episode["normalized_performance"] for episode in self.model.ep_info_buffer]
        self.rows.append({"steps": self.num_timesteps, "wall_s": round(time.perf_counter() - self.begin, 1),
                          "mean": scores.mean(), "least": scores.min(), "largest": scores.max(),
                          "training_mean": np.mean(noisy) if noisy else float("nan")})
        print(" ".join(f"{name} {value:.3f}" for name, value in self.rows[-1].items()), flush=True)

    def _on_training_end(self):
        self.next = 0
        self._on_rollout_start()

    def _on_step(self):
        return True


def learn(client, steps, seed, envs, side):
    """The curve, and the mean of random actions and of the policy by hand on the same starts."""
    set_random_seed(seed)
    torch.set_num_threads(1)  # the networks are small, and the server has the cores
    judged = make(client, JUDGED, side)
    judged.action_space.seed(seed)
    bars = {"random": play(judged, lambda _: judged.action_space.sample()).mean(),
            "by hand": play(judged, lambda _: scripted.lay_down(judged)).mean()}
    env = VecMonitor(StableVecEnv(make(client, envs, side)), info_keywords=("normalized_performance",))
    env = VecNormalize(env, gamma=0.95)
    env.seed(seed)
    horizon = DropFlat.horizon
    model = PPO("MlpPolicy", env, n_steps=horizon, batch_size=envs * horizon // 8, n_epochs=10, gamma=0.95, gae_lambda=0.9,
                learning_rate=lambda left: 3e-4 + 7e-4 * left, ent_coef=0.0, clip_range=0.2, seed=seed, device="cpu",
                policy_kwargs={"net_arch": [64, 64], "log_std_init": -1.0})
    with torch.no_grad():
        model.policy.action_net.bias[[3, 7]] = 1.5  # pickers stay closed at first, as an episode begins
    rows = []
    model.learn(steps, callback=Judge(judged, max(steps // 25, 1), rows))
    env.close()
    judged.close()
    return rows, bars


def draw(path, rows, bars):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    steps = [row["steps"] for row in rows]
    axes.fill_between(steps, [row["least"] for row in rows], [row["largest"] for row in rows], alpha=0.2, lw=0)
    axes.plot(steps, [row["mean"] for row in rows], label="PPO, mean and range")
    for (name, value), style in zip(bars.items(), (":", "--")):
        axes.axhline(value, color="0.4", ls=style, label=name)
    axes.set(xlabel="actions of an environment", ylabel="normalized performance", ylim=(None, 1.02))
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--side", type=int, default=16)
    flags = parser.parse_args()
    with drape.launch("cpu", flags=["--threads=1"]) as client:  # the learner has the other core
        rows, bars = learn(client, flags.steps, flags.seed, flags.envs, flags.side)
    print(" ".join(f"{name} {value:.3f}" for name, value in bars.items()))
    with open(f"{flags.out}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, [*rows[0], *bars])
        writer.writeheader()
        writer.writerows({name: f"{value:.4g}" if isinstance(value, float) else value
                          for name, value in {**row, **bars}.items()} for row in rows)
    if importlib.util.find_spec("matplotlib"):
        draw(f"{flags.out}.png", rows, bars)


if __name__ == "__main__":
    main()
