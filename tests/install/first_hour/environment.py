"""A vector environment by its id: whole episodes."""

import gymnasium
import numpy as np

env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=4, max_episode_steps=3)
env.reset(seed=1)
env.action_space.seed(1)
ended = 0
while ended < 4:
    observations, rewards, terminated, truncated, infos = env.step(env.action_space.sample())
    assert np.isfinite(observations).all() and np.isfinite(rewards).all()
    ended += int((terminated | truncated).sum())
env.close()
print(f"environment: {ended} episodes")
