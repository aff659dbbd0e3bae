"""Policies by hand: what a learner is to be compared with, and a test that each task can be solved."""

from __future__ import annotations

import numpy as np


def towards(env, places, hold=True):
    """The actions [n, 8] that bring the pickers to `places` [n, 2, 3], as far as one action reaches."""
    reach = env.picker_step_m * env.action_repeat
    motion = np.clip((places - env.pickers.positions) / reach, -1, 1)
    holds = np.full((*motion.shape[:2], 1), 1.0 if hold else 0.0)
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
