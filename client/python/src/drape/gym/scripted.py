"""Policies by hand: what a learner is to be compared with, and a test that each task can be solved.

Each takes a vector environment after its `reset` and returns the next actions, float32[n, 8]; call it before every step,
from the first one on: `env.step(scripted.cover(env))`. They look at the environment itself (pickers, starts, elapsed
actions), not at observations. With autoreset NEXT_STEP the action of a step that begins an episode is ignored.
`towards` and `lay_down` (for DropFlat) are the parts that they are made of.
"""

from __future__ import annotations

import numpy as np

from drape.gym import poses
from drape.gym.tasks import THICKNESS_M


def towards(env, places, hold=True):
    """The actions [n, 8] that bring the pickers to `places` [n, 2, 3], as far as one action reaches. hold: whether they
    close, a bool or [n]."""
    reach = env.picker_step_m * env.action_repeat
    motion = np.clip(env.in_action_frame((places - env.pickers.positions) / reach), -1, 1)
    holds = np.broadcast_to(np.reshape(hold, (-1, 1, 1)), (*motion.shape[:2], 1))
    return np.concatenate([motion, holds], -1).reshape(len(places), -1).astype(np.float32)


def lay_down(env, speed_m=0.08, approach_m=0.0, low_m=0.005):
    """Lowers the sheet until its lowest row touches the floor, then lays it down forwards: as much as lies already, so
    much lower are the pickers, so that the rest hangs down straight and pulls at nothing. speed_m: of the pickers per
    action. approach_m: [n] or a number, forwards before that. low_m: height at the end."""
    along = env.pickers.positions[:, 1] - env.pickers.positions[:, 0]
    corner = env.starts[:, :3]
    gap = corner[:, 1] - env.size_m  # below the lowest row
    approach = np.broadcast_to(np.asarray(approach_m, float), gap.shape)
    way = (env.elapsed + 1.0) * speed_m
    ahead = np.clip(way, 0, approach)
    down = np.clip(way - approach, 0, gap)
    laid = np.clip((way - approach - gap) * np.sqrt(0.5), 0, env.size_m)
    height = np.maximum(env.size_m + gap - down - laid, low_m)
    first = corner * [1, 0, 1] + env.forward * (ahead + laid)[:, None]
    first[:, 1] = height
    width = np.linalg.norm(along, axis=1)
    direction = np.where(width[:, None] > 0, along / np.maximum(width, 1e-9)[:, None], 0)
    return towards(env, np.stack([first, first + direction * env.size_m], 1))


def cover(env, speed_m=0.08):
    """For CoverSphere: carries the lowest row to 20 cm before the sphere, then lays the sheet down over it."""
    middle = env.starts[:, :3] + 0.5 * (env.pickers.positions[:, 1] - env.pickers.positions[:, 0])
    away = -(middle * env.forward).sum(1)
    return lay_down(env, speed_m, approach_m=away - 0.5 * env.size_m)


def fling(env, back_m=0.3, lift_m=0.45, ahead_m=0.1):
    """For FlingFlat: swings the sheet back and up, then flings it forwards and down to the floor in one go, as fast as
    the pickers are: it flies over them and lies ahead."""
    corner = env.starts[:, :3]
    along = env.pickers.positions[:, 1] - env.pickers.positions[:, 0]
    swings = env.elapsed < 5
    first = corner * [1, 0, 1] + env.forward * np.where(swings, -back_m, ahead_m)[:, None]
    first[:, 1] = np.where(swings, corner[:, 1] + lift_m, 0.005)
    way = first - env.pickers.positions[:, 0]
    reach = env.picker_step_m * env.action_repeat * np.where(env.elapsed < 4, 1.0, 1.1)
    way *= np.minimum(1, reach / np.maximum(np.linalg.norm(way, axis=1), 1e-9))[:, None]
    first = env.pickers.positions[:, 0] + way
    return towards(env, np.stack([first, first + along], 1))


def fold(env, begin=5, arc=14):
    """For FoldHalf: takes the corners of the first row and lays them onto those of the last, in an arc over the middle.
    begin: actions to reach the corners; arc: of the way over."""
    corner, forward = env.starts[:, :3], env.forward
    along = poses.row_direction(poses.yaw_of(env.starts)) * env.size_m
    angle = np.pi * np.clip((env.elapsed - begin) / arc, 0, 1)[:, None]
    # Below the circle, so that what is carried sags and does not pull at what lies.
    first = corner + (forward * (1 - np.cos(angle)) + [0, 0.6, 0] * np.sin(angle)) * (env.size_m / 2)
    first[:, 1] += 0.01 * angle[:, 0] / np.pi  # the layer below
    leaves = env.elapsed > begin + arc + 2
    first[leaves, 1] += 0.1
    return towards(env, np.stack([first, first + along], 1), (env.elapsed >= begin) & ~leaves)


def spread(env, reach=8, lift=10, rest=8, speed_m=0.06, low_m=0.01, attempt=50, enough=0.9):
    """For Flatten: takes the corners of the first row, wherever they lie, lifts the sheet until it hangs, and lays it
    down as `lay_down`. What covers less than `enough` of its area after `attempt` actions is lifted again, by the
    corners of the last row. reach, lift, rest: actions to get there, up, and until it no longer swings. speed_m: of the
    pickers per action, down. low_m: height at the end."""
    at, when = env.pickers.positions, env.elapsed % attempt
    is_first = env.elapsed < attempt
    covers = env._performance(env.cloths.positions, np.arange(env.num_envs))
    acts = is_first | env.pickers.holds.any(1) | (covers < enough)
    middle = at.mean(1)
    along = (at[:, 1] - at[:, 0]) * [1, 0, 1]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 1e-6, along / np.maximum(length, 1e-9), [1.0, 0, 0])
    # Straight down until the lowest row touches the floor, then as much ahead as down.
    ahead = np.cross(along, [0, 1.0, 0])
    slope = np.where(middle[:, 1:2] > env.size_m, [0, -1.0, 0], np.sqrt(0.5) * (ahead - [0, 1, 0]))
    lies = middle[:, 1] <= low_m
    down = np.where(lies[:, None], middle, middle + speed_m * slope)
    down[:, 1] = np.maximum(down[:, 1], low_m)
    up = middle * [1, 0, 1] + [0, env.size_m + 0.03, 0]
    hangs = when >= reach + lift + rest
    middle = np.where(hangs[:, None], down, up)
    places = middle[:, None] + 0.5 * env.size_m * np.stack([-along, along], 1)
    row = np.array([0, env.side - 1])
    corners = np.where(is_first[:, None, None], env.cloths.positions[:, row],
                       env.cloths.positions[:, env.side * (env.side - 1) + row])
    places = np.where((when <= reach)[:, None, None], corners, places)
    places = np.where(acts[:, None, None], places, at)
    return towards(env, places, acts & (when >= reach) & ~(hangs & lies))


def hang(env, begin=6, arc=12, slack=0.97):
    """For Hang: carries the sheet to the rail until it touches it, winds its upper half around the rail, and lets go.
    begin: actions to get there; arc: around the rail. slack: how much of the free length the pickers keep to, so that
    the sheet does not slide."""
    _, height, radius = env.rail_m
    radius += THICKNESS_M
    yaw = poses.yaw_of(env.starts)
    side = np.sign(np.cos(yaw))[:, None]
    along, forward, up = side * [env.size_m, 0, 0], side * [0, 0, 1.0], np.array([0, 1.0, 0])
    middle = env.starts[:, :3] + poses.row_direction(yaw) * env.size_m / 2
    over = middle * [1, 0, 0] + up * height  # on the axis
    angle = np.pi * np.clip((env.elapsed - begin) / arc, 0, 1)[:, None]
    # An involute: what is wound up is no longer free. In the end half the sheet is on either side of the top.
    free = env.size_m / 2 + radius * (np.pi / 2 - angle)
    held = (over + radius * (np.sin(angle) * up - np.cos(angle) * forward)
            + slack * free * (np.cos(angle) * up + np.sin(angle) * forward))
    places = np.stack([held - along / 2, held + along / 2], 1)
    return towards(env, places, env.elapsed <= begin + arc)
