"""The vector environment below all tasks: n cloths, one Step per step, and one more where some begin an episode."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import drape
from drape import devices, v1
from drape.gym import marks, poses
from drape.gym.pickers import Pickers

TIME_STEP_S = 1 / 60
_WIDTH_PX, _HEIGHT_PX = 320, 240
_MOST_PIXELS = 1 << 23  # of tiles with depths in one request


class ClothVectorEnv(VectorEnv):
    """n environments of one task, made as e.g. `DropFlat(64, render_mode="rgb_array")`. All semantics are those of gymnasium 1.x: three modes of autoreset, `reset_mask`,
    seeds per environment (environment i of `reset(seed=s)` has the seed s + i, and its results do not depend on the
    others).

    action: float32[n, 8], per picker a motion [-1, 1]^3, clipped to that, in units of `picker_step_m` per simulated step
    (an action moves a picker by up to `picker_step_m * action_repeat` along each axis), and [0, 1]: above 0.5 it closes, and grabs the nearest particle within `picker_radius_m` if it holds none. observation:
    float32[n, ...]: positions [m] of keypoints ("keypoints": 5 x 5 of them) or of all particles ("particles"), then of
    the pickers, then 1 or 0 for each that holds. reward: the performance of the task. Episodes are truncated after
    `max_episode_steps` (None: the task's `horizon`); one whose cloth blows up is terminated. info: "performance", "normalized_performance" (0 at the
    start, 1 at the best), each [n].

    autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, of gymnasium.vector.AutoresetMode. render_mode: None or "rgb_array"
    (`render` works with both). client: where the cloths live; None: a private server of `backend` (None: the best that the task can use) with
    `threads` threads (None: one per core), which ends with the environment; where Ray or another scheduler has given
    this process a GPU (CUDA_VISIBLE_DEVICES), the server takes that one. side: particles along each edge of the
    sheet; None: the task's. frame: of positions in observations and of motions in actions: "world"; or "start", in
    which every sheet starts alike: the origin is on the floor below the middle of its first row, which points along +x;
    +z is where the sheet is to go. What lies elsewhere (the sphere of CoverSphere) is then at a drawn place. starts,
    cloths and pickers are in the world in both.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}

    _made_of = None
    _session = _owned = None  # of one that could not be made, which gymnasium closes when it is collected

    _stays = ("cloths", "_session", "_owned", "_made_of")  # what a snapshot leaves out: it belongs to a server

    # Of a task:
    action_repeat = 8  # simulated steps per action
    horizon = 50
    picker_step_m = 0.01
    picker_radius_m = 0.05
    side = 32  # particles along an edge
    size_m = 0.4
    best_performance = 0.0
    touches_itself = False
    camera = v1.Camera(eye_m=[0.85, 1.0, 1.2], target_m=[0, 0.15, 0], vertical_field_of_view_rad=0.65)  # of `render`

    def __init__(self, num_envs: int = 1, *, max_episode_steps: int | None = None, observation: str = "keypoints",
                 autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP, client: drape.Client | None = None,
                 backend: str | None = None, render_mode: str | None = None, side: int | None = None,
                 frame: str = "world", threads: int | None = None):
        if observation not in ("keypoints", "particles"):
            raise ValueError(f"observation: 'keypoints' or 'particles', got {observation!r}")
        if frame not in ("world", "start"):
            raise ValueError(f"frame: 'world' or 'start', got {frame!r}")
        if side is not None and not (isinstance(side, (int, np.integer)) and side >= 5):
            raise ValueError(f"side: a whole number of at least 5 particles, got {side!r}")
        if max_episode_steps is not None and not (isinstance(max_episode_steps, (int, np.integer)) and max_episode_steps >= 1):
            raise ValueError(f"max_episode_steps: a whole number >= 1, got {max_episode_steps!r}")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: None or one of {self.metadata['render_modes']}, got {render_mode!r}")
        if not isinstance(num_envs, (int, np.integer)) or isinstance(num_envs, bool) or num_envs < 1:
            raise ValueError(f"num_envs: a whole number >= 1, got {num_envs!r}")
        if not isinstance(autoreset_mode, AutoresetMode) and autoreset_mode not in [mode.value for mode in AutoresetMode]:
            raise ValueError(f"autoreset_mode: one of {[mode.value for mode in AutoresetMode]}, got {autoreset_mode!r}")
        if not isinstance(client, (drape.Client, type(None))):
            raise TypeError(f"client: a drape.Client, or None, got {client!r}")
        self.num_envs = num_envs
        self.side = side or self.side
        self._turns = frame == "start"
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self._horizon = self._limit = max_episode_steps or self.horizon  # _limit: after which episodes are truncated here
        backend = backend or ("cpu" if self.touches_itself else "auto")
        self.pickers = Pickers((0, self.side - 1), self.picker_step_m, self.picker_radius_m, [-1.0, 0.0, -1.0],
                               [1.0, 1.0, 1.0])
        self._owned = _launch(backend, threads) if client is None else None
        self._session = (client or self._owned).session(display_name=type(self).__name__)
        try:
            self.cloths = self._session.create(self._spec(), num_envs)
        except BaseException:  # the server would live as long as somebody keeps the error
            self.close_extras()
            raise
        self.pickers.attach(self.cloths)
        self._shown = self._keypoints() if observation == "keypoints" else np.arange(self.cloths.particles)
        self._make_spaces()
        self._generators = [seeding.np_random()[0] for _ in range(num_envs)]
        self._starts = np.zeros((num_envs, 7))
        self._positions = np.zeros((num_envs, self.cloths.particles, 3), self._session.dtype)
        self._elapsed = np.zeros(num_envs, int)
        self._first = np.zeros(num_envs)
        self._done = np.ones(num_envs, bool)
        self._has_begun = False

    # --- what a task gives

    def _material(self) -> v1.Material:
        """Of the cloth; in the mean a cotton of 150 g/m^2."""
        return v1.Material(areal_density_kg_per_m2=0.15, bending_rigidity_n_m=1e-5, damping_per_s=0.5,
                           friction_static=0.5, friction_dynamic=0.4, thickness_m=0.005)

    def _environment(self) -> v1.Environment:
        """A floor at height 0."""
        return v1.Environment(colliders=[v1.Collider(plane=v1.Plane(point_m=[0, 0, 0], normal=[0, 1, 0]))])

    def _draw_start(self, rng) -> np.ndarray:
        """[7] where and how a cloth starts: a transform of the flat sheet."""
        raise self._lacks("_draw_start")

    def _settle(self, rows, positions) -> np.ndarray:
        """Steps the cloths `rows`, which have just been reset to their starts at positions [m, particles, 3], to where
        their episodes begin. Returns their positions then."""
        return positions

    def _prepare(self, rows, positions) -> None:
        """Episodes begin in the environments `rows`, at positions [m, particles, 3]: the pickers hold their
        particles."""
        self.pickers.begin(rows, positions)

    def _performance(self, positions, rows) -> np.ndarray:
        """[m], larger is better, of the environments `rows`: positions [m, particles, 3]."""
        raise self._lacks("_performance")

    def _outlines(self, rows) -> np.ndarray | None:
        """[m, k, 3]: points where pictures of the environments `rows` show the aim; None: nowhere."""
        return None

    # --- gymnasium

    def reset(self, *, seed=None, options=None):
        """Begins episodes. seed: a whole number, of environment 0 (i has seed + i), or one for each; None: random numbers go
        on. options: {"reset_mask": bool[n]} for some environments alone; there are no others. Returns (observations, infos).
        Raises ValueError and TypeError for wrong arguments, and what the server does."""
        mask = checked_mask(options, self.num_envs)
        unknown = [name for name in options or () if name != "reset_mask"]
        if unknown:  # ignored, a misspelled mask would begin all episodes
            raise ValueError(f"options: a reset has no option {unknown[0]!r}; it has 'reset_mask'")
        seeds = checked_seeds(seed, self.num_envs)
        if mask is None or not self._has_begun:
            mask = np.ones(self.num_envs, bool)
        for k in np.flatnonzero(mask):
            if seeds[k] is not None:
                self._generators[k] = seeding.np_random(seeds[k])[0]
        self._begin(mask)
        self._has_begun = True
        return self._observe(), self._info(self._measure(), mask)

    def step(self, actions):
        """One action of each environment: float32[n, 8], as of the class. Returns (observations, rewards float64[n],
        terminated bool[n], truncated bool[n], infos). Raises ValueError for actions of another shape or not finite,
        RuntimeError before the first `reset` and of environments that have ended where autoreset is DISABLED."""
        actions = self._checked_actions(actions)
        begins = self._done if self.autoreset_mode == AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)
        if self.autoreset_mode == AutoresetMode.DISABLED and self._done.any():
            raise RuntimeError(f"environments {np.flatnonzero(self._done).tolist()} have ended: reset them by reset_mask")
        acts = ~begins
        if acts.any():
            self._advance(actions, acts)
        if begins.any():
            self._begin(begins.copy())
        performance = self._measure()
        rewards = np.where(acts, performance, 0.0)
        terminated = acts & self.cloths.faulted
        truncated = acts & ~terminated & (self._elapsed >= self._limit)
        self._done = terminated | truncated
        info = self._info(performance, np.ones(self.num_envs, bool))
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._done.any():
            ended = self._done.copy()
            final = {"final_obs": _where(ended, self._observe()), "_final_obs": ended,
                     "final_info": {name: _where(ended, value) for name, value in info.items()}, "_final_info": ended}
            self._begin(ended)
            info = {**self._info(self._measure(), np.ones(self.num_envs, bool)), **final}
        return self._observe(), rewards, terminated, truncated, info

    def render(self):
        """One uint8[240, 320, 3] per environment, all by the task's `camera`, in one request for up to 109 of them: the cloth,
        the floor and what the task puts on it; pickers as discs, blue where they hold something, orange where they are open;
        of DropFlat and Hang the outline of the target in red. Raises FailedPrecondition (NO_EGL_DEVICE) if the server cannot
        draw."""
        at_once = max(1, _MOST_PIXELS // (_WIDTH_PX * _HEIGHT_PX))
        every = np.arange(self.num_envs)
        return tuple(picture for begin in every[::at_once] for picture in self._drawn(every[begin:begin + at_once]))

    def snapshot(self) -> bytes:
        """Everything that the environments go on from, between two actions: cloths, pickers, episodes, random numbers,
        and whatever else a subclass keeps in attributes, which `pickle` must know; about 50 kB for 1024 particles.
        `restore` in an environment of the same arguments goes on from it with the same bits."""
        kept = {name: value for name, value in vars(self).items() if name not in self._stays}
        return pickle.dumps((self._kind(), kept, self.cloths._pending, self.cloths.snapshot()))

    def restore(self, snapshot: bytes, *, inexact: bool = False) -> None:
        """Goes on from what `snapshot` gave, here or in another process; only from those you trust, since `pickle` reads
        it. inexact: also if the server is of another build, backend or device, with other bits. Raises ValueError for
        the snapshot of another task or number of environments and for what is no snapshot, FailedPrecondition
        (OTHER_BUILD)."""
        try:
            kind, kept, pending, cloths = pickle.loads(snapshot)
        except (pickle.UnpicklingError, EOFError, LookupError, AttributeError, ImportError, ValueError, TypeError) as error:
            raise ValueError(f"snapshot: is not what snapshot() gives: {error}") from error
        if kind != self._kind():
            raise ValueError(f"snapshot: of (task, environments, particles) {kind}, these are {self._kind()}")
        restored = self._session.restore(cloths, spec=self.cloths.spec, inexact=inexact)
        restored._pending = pending
        self.cloths.delete()
        self.cloths = restored
        vars(self).update(kept)
        self.pickers.attach(restored)

    def close_extras(self, **_):
        """What `close()` ends: the session, and the private server."""
        if self._session is not None:
            self._session.close()
        if self._owned is not None:
            self._owned.close()

    # --- parts

    @property
    def spec(self):
        """What `gymnasium.make_vec` made it of, with the `max_episode_steps` that it has; None if it did not."""
        return self._made_of

    @spec.setter
    def spec(self, spec):
        self._made_of = spec if spec is None else dataclasses.replace(spec, max_episode_steps=int(self._horizon))

    @property
    def starts(self):
        """[n, 7]: the transform with which each episode began."""
        return self._starts

    @property
    def forward(self):
        """[n, 3]: level unit vector from row to row of a sheet that lies, or towards which one that hangs is to be laid
        down."""
        return poses.forward_direction(poses.yaw_of(self._starts))

    @property
    def elapsed(self):
        """[n]: actions since then."""
        return self._elapsed

    def in_action_frame(self, motions):
        """Motions [n, k, 3] of the world as those of an action (`frame`)."""
        return poses.turned(motions, -poses.yaw_of(self._starts)) if self._turns else motions

    def _drawn(self, rows):
        """[m, height, width, 3]: pictures of these environments."""
        pictures, depths = self.cloths.render_tiles(_WIDTH_PX, _HEIGHT_PX, self.camera, ids=rows, with_depths=True)
        if not self._has_begun:
            return pictures
        pictures = pictures.copy()
        marks.draw(pictures, depths, self.camera, self.pickers.positions[rows], self.pickers.holds[rows], self._outlines(rows))
        return pictures

    def _spec(self):
        return v1.ClothSpec(
            grid=v1.Grid(columns=self.side, rows=self.side, width_m=self.size_m, height_m=self.size_m),
            material=self._material(), environment=self._environment(), max_grips=self.pickers.num,
            self_collision=v1.SelfCollision() if self.touches_itself else None,
            settings=v1.StepSettings(time_step_s=TIME_STEP_S, substeps=20))

    @property
    def _stamp_m(self):
        """Half side of the square that a particle covers: so large that those of a flat sheet leave no gap at any
        yaw."""
        return np.sqrt(0.5) * self.size_m / (self.side - 1)

    def _keypoints(self):
        line = np.rint(np.linspace(0, self.side - 1, 5)).astype(int)
        return (line[:, None] * self.side + line).ravel()

    def _make_spaces(self):
        low, high = [-1, -1, -1, 0] * self.pickers.num, [1] * 4 * self.pickers.num
        self.single_action_space = spaces.Box(np.float32(low), np.float32(high))
        numbers = 3 * len(self._shown) + 4 * self.pickers.num
        self.single_observation_space = spaces.Box(-np.inf, np.inf, (numbers,), np.float32)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def _lacks(self, method):
        return NotImplementedError(f"{type(self).__name__} has no {method}(), which a task must give: a subclass of ClothVectorEnv "
                                   "such as drape.gym.DropFlat")

    def _kind(self):
        return type(self).__name__, self.num_envs, self.cloths.particles

    def _begin(self, mask):
        """New episodes in the environments of `mask`."""
        rows = np.flatnonzero(mask)
        self._starts[rows] = [self._draw_start(self._generators[k]) for k in rows]
        self.cloths.restart(rows, transforms=self._starts[rows])
        # One request resets and reads: there is no step to do. A Step has one number of steps for all of its cloths, so those
        # that act have one of their own.
        begun = self._settle(rows, self.cloths.step(until=0, ids=rows).positions)
        self._keep(begun, rows)
        self._prepare(rows, begun)
        self._elapsed[rows] = 0
        self._done = self._done & ~mask
        self._first[rows] = self._performance(begun, rows)

    def _advance(self, actions, acts):
        everyone = acts.all()
        self.pickers.act(self._in_world(actions.reshape(self.num_envs, -1, 4)), acts, self.action_repeat,
                         self.action_repeat * TIME_STEP_S)
        answer = self.cloths.step(self.action_repeat, grips=True, ids=None if everyone else acts)
        self.pickers.note(answer.rows, answer.grips)
        self._keep(answer.positions, None if everyone else answer.rows)
        self._elapsed[acts] += 1

    def _keep(self, positions, rows):
        if rows is None or len(rows) == self.num_envs:
            self._positions = positions
            return
        if not self._positions.flags.writeable:
            self._positions = self._positions.copy()
        self._positions[rows] = positions

    def _measure(self):
        return self._performance(self._positions, np.arange(self.num_envs)).astype(np.float64)

    def _in_world(self, actions):
        """Actions [n, k, 4] within their limits, their motions in the frame of the world."""
        motions = np.clip(actions[..., :3], -1, 1)
        if self._turns:
            motions = poses.turned(motions, poses.yaw_of(self._starts))
        return np.concatenate([motions, actions[..., 3:]], -1)

    def _observe(self):
        places = np.concatenate([self._positions[:, self._shown], self.pickers.positions], 1)
        if self._turns:
            places = poses.seen_from(self._starts, self.size_m, places)
        return np.concatenate([places.reshape(self.num_envs, -1), self.pickers.holds], axis=1).astype(np.float32)

    def _info(self, performance, mask):
        share = (performance - self._first) / (self.best_performance - self._first)
        return {"performance": performance, "_performance": mask,
                "normalized_performance": share, "_normalized_performance": mask}

    def _checked_actions(self, actions):
        if not self._has_begun:
            raise RuntimeError("reset() comes before the first step()")
        return checked_actions(actions, self.action_space.shape)


def _launch(backend, threads):
    flags = [] if threads is None else [f"--threads={threads}"]
    device = devices.assigned() if backend in ("auto", "gl") else None
    return drape.launch(backend, flags=flags if device is None else [*flags, f"--device={device}"])


def checked_actions(actions, shape):
    """`actions` as float64 of this shape."""
    actions = np.asarray(actions)
    if actions.shape != shape or actions.dtype.kind not in "biuf":
        raise ValueError(f"actions: numbers of the shape {shape} are needed, got {actions.dtype} of the shape {actions.shape}")
    actions = actions.astype(np.float64)
    if not np.isfinite(actions).all():
        raise ValueError("actions: every number must be finite")
    return actions


def checked_mask(options, count):
    """A copy of the `reset_mask` bool[count] among the options of a reset; None if there is none."""
    if not isinstance(options, (dict, type(None))):
        raise TypeError(f"options: a dict, got {type(options).__name__}")
    if options is None or "reset_mask" not in options:
        return None
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"reset_mask: an array of bool, got {getattr(mask, 'dtype', type(mask).__name__)}")
    if mask.shape != (count,):
        raise ValueError(f"reset_mask: the shape ({count},) is needed, got {mask.shape}")
    if not mask.any():
        raise ValueError("reset_mask: at least one must be True")
    return mask.copy()


def checked_seeds(seed, count):
    """`count` seeds of a reset's argument, None where there is none: seed + i, or one for each."""
    if seed is None:
        return [None] * count
    given = [seed] if np.ndim(seed) == 0 else list(seed)
    for one in given:
        if one is not None and not (isinstance(one, (int, np.integer)) and one >= 0):
            raise ValueError(f"seed: a whole number >= 0, or one of each environment, got {one!r}")
    seeds = [seed + k for k in range(count)] if np.ndim(seed) == 0 else given
    if len(seeds) != count:
        raise ValueError(f"seed: {count} are needed, got {len(seeds)}")
    return [None if one is None else int(one) for one in seeds]


def _where(mask, values):
    kept = np.zeros_like(values)
    kept[mask] = values[mask]
    return kept
