"""Random actions in 64 environments of DropFlat for two episodes, beside the policy by hand.

random_policy.py [ENVS [EPISODES]]. Needs the extra `gym`; half a minute on two cores.
"""

import sys
import time

import gymnasium

from drape.gym import scripted

envs = int(sys.argv[1]) if len(sys.argv) > 1 else 64
episodes = int(sys.argv[2]) if len(sys.argv) > 2 else 2

env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=envs)
horizon = env.spec.max_episode_steps
policies = {"random": lambda: env.action_space.sample(), "by hand": lambda: scripted.lay_down(env.unwrapped)}
for name, policy in policies.items():
    observation, info = env.reset(seed=1)
    begin, actions = time.perf_counter(), 0
    for _ in range(episodes):
        for _ in range(horizon):
            observation, reward, terminated, truncated, info = env.step(policy())
            actions += envs
        score = info["normalized_performance"]
        print(f"{name}: normalized performance {score.mean():.3f} in the mean, {score.max():.3f} at best")
        observation, *_ = env.step(env.action_space.sample())  # NEXT_STEP: this one resets
    print(f"{name}: {actions / (time.perf_counter() - begin):.0f} actions of an environment per second")
env.close()
