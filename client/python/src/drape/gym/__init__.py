"""Vector environments of cloth manipulation for gymnasium (pip install drape-sim[gym]).

    env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=64)

`drape.gym.ClothVectorEnv` has the semantics, the tasks are its subclasses, `drape.gym.scripted` has policies by hand.
"""

import gymnasium

from .tasks import CoverSphere, DropFlat, FlingFlat
from .vector import ClothVectorEnv

__all__ = ["ClothVectorEnv", "CoverSphere", "DropFlat", "FlingFlat"]

for _task in (DropFlat, FlingFlat, CoverSphere):
    _id = f"drape/{_task.__name__}-v0"
    if _id not in gymnasium.registry:
        gymnasium.register(_id, entry_point=f"drape.gym.single:{_task.__name__}",
                           vector_entry_point=f"drape.gym.tasks:{_task.__name__}", max_episode_steps=_task.horizon)
