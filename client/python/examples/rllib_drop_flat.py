"""PPO of RLlib on DropFlat: env runners in processes of their own, each with a server of its own.

rllib_drop_flat.py [ITERATIONS [RUNNERS [ENVS [SIDE]]]]. Needs the extra `gym`, and pip install 'ray[rllib]' torch.
"""

import sys

from ray.rllib.algorithms.ppo import PPOConfig

iterations, runners, envs, side = (int(value) for value in (sys.argv[1:] + ["20", "1", "16", "8"][len(sys.argv) - 1:])[:4])

config = (
    PPOConfig()
    # Nothing of drape is needed but the name: gymnasium makes a vector of environments by it.
    .environment("drape.gym:drape/DropFlat-v0", env_config={"side": side, "frame": "start", "threads": 1})
    .env_runners(num_env_runners=runners, num_envs_per_env_runner=envs, gym_env_vectorize_mode="vector_entry_point")
    .fault_tolerance(restart_failed_env_runners=True)  # one whose server dies is made again, with a new server
    .training(train_batch_size=30 * envs * runners, minibatch_size=120, num_epochs=10, lr=3e-4, gamma=0.95))
algorithm = config.build_algo()
for iteration in range(iterations):
    found = algorithm.train()["env_runners"]
    print(f"{iteration + 1}: {found['num_env_steps_sampled_lifetime']:.0f} actions, return {found['episode_return_mean']:.2f} in "
          "the mean", flush=True)
algorithm.stop()
