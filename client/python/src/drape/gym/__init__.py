"""Vector environments of cloth manipulation for gymnasium (extra `gym`).

    env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=64)

`drape.gym.ClothVectorEnv` has the semantics, the tasks are its subclasses, `drape.gym.scripted` has policies by hand.
"""

from drape import extras

extras.need("gymnasium", "gym")

import gymnasium

from .floor_tasks import Flatten, FoldHalf
from .tasks import CoverSphere, DropFlat, FlingFlat, Hang
from .vector import ClothVectorEnv

__all__ = ["ClothVectorEnv", "CoverSphere", "DropFlat", "Flatten", "FlingFlat", "FoldHalf", "Hang"]

for _task in (DropFlat, FlingFlat, CoverSphere, FoldHalf, Flatten, Hang):
    _id = f"drape/{_task.__name__}-v0"
    if _id not in gymnasium.registry:
        gymnasium.register(_id, entry_point=f"drape.gym.single:{_task.__name__}",
                           vector_entry_point=f"drape.gym:{_task.__name__}", max_episode_steps=_task.horizon)
