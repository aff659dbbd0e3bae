"""Shards on a Ray cluster of two nodes in this machine, whose servers, actors and nodes are killed. Full tier: needs Ray."""

import contextlib
import os
import pathlib
import signal
import time

import numpy as np
import pytest

pytestmark = pytest.mark.full
ENVS, ACTIONS = 6, 5


@pytest.fixture(scope="module")
def cluster():
    import ray
    from ray.cluster_utils import Cluster

    os.environ.setdefault("RAY_worker_niceness", "0")  # 15 by default: anything else on the machine would go first
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "num_gpus": 2})  # GPUs on paper
    cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


made = []


@pytest.fixture(autouse=True)
def closing():
    """Of what a test made, however it ends: the next one needs the room."""
    yield
    while made:
        made.pop().close()


def make(task=None, num_cpus=1, **arguments):
    """Two shards, each on a node of its own: it takes the node's processor, once the test before has given it back."""
    import ray
    from drape.gym import DropFlat
    from drape.gym.shards import ShardedVectorEnv

    end = time.monotonic() + 60
    while ray.available_resources().get("CPU", 0) < 2:
        assert time.monotonic() < end, ray.available_resources()
        time.sleep(0.05)
    made.append(ShardedVectorEnv(task or DropFlat, ENVS, shards=2, num_cpus=num_cpus, **{"backend": "cpu", **arguments}))
    return made[-1]


def actions(seed=3):
    random = np.random.default_rng(seed)
    return random.uniform(-1, 1, (ACTIONS, ENVS, 8)).astype(np.float32)


def ray_get(future):
    import ray

    return ray.get(future)


def equal(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(equal, a, b))
    return np.array_equal(a, b)


def play(env, disturb=lambda number: None):
    """All that a trainer sees of an episode and of a reset of some environments."""
    mask = np.zeros(ENVS, bool)
    mask[[0, 1]] = True  # of the first shard alone
    seen = [env.reset(seed=11)]
    for number, action in enumerate(actions()):
        disturb(number)
        seen.append(env.step(action))
    seen.append(env.reset(options={"reset_mask": mask}))
    seen.append(env.step(actions()[0]))
    return seen


@pytest.fixture(scope="module")
def undisturbed():
    from drape.gym import DropFlat

    env = DropFlat(ENVS, backend="cpu", max_episode_steps=4)
    seen = play(env)
    env.close()
    return seen


def test_shards_are_one_environment(cluster, undisturbed):
    env = make(max_episode_steps=4)
    assert len({place["node"] for place in env.places()}) == 2
    assert equal(play(env), undisturbed)
    assert env.recoveries == 0
    assert "--threads=1" in server_flags(env)[0], "as many as the processors that Ray lends to the shard"


def server_flags(env):
    return [pathlib.Path(f"/proc/{place['server_pid']}/cmdline").read_text().split("\0") for place in env.places()]


def test_each_server_has_the_gpu_of_its_actor(cluster, tmp_path):
    """Ray numbers them as nvidia-smi does, the server by EGL: both lists are imitations, and the server steps on the CPU."""
    import drape

    uuids = [f"GPU-{k}0000000-aaaa-bbbb-cccc-dddddddddddd" for k in (1, 2)]
    for name, text in {
        "draped": f"""
            if [ "$1" = --list-devices ]; then
              echo "0  0000:c1:00.0  {uuids[1]}"; echo "1  0000:65:00.0  {uuids[0]}"
            else
              exec {drape.find_server()} "${{@/--backend=auto/--backend=cpu}}"
            fi""",
        "nvidia-smi": f"echo '0, {uuids[0]}, 00000000:65:00.0'; echo '1, {uuids[1]}, 00000000:C1:00.0'",
    }.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{text}\n")
        (tmp_path / name).chmod(0o755)

    def task(num_envs, **arguments):
        from drape.gym import DropFlat

        os.environ.update(DRAPE_SERVER=str(tmp_path / "draped"), PATH=f"{tmp_path}:/usr/bin:/bin")
        return DropFlat(num_envs, **arguments)

    env = make(task, num_cpus=0.5, num_gpus=1, backend="auto")
    devices = [flag for flags in server_flags(env) for flag in flags if flag.startswith("--device=")]
    assert sorted(devices) == [f"--device={uuid}" for uuid in uuids]


def kill(env, cluster, victim):
    if victim == "server":
        os.kill(env.places()[1]["server_pid"], signal.SIGKILL)
    elif victim == "actor":
        os.kill(env.places()[1]["pid"], signal.SIGKILL)
    else:
        _, node = cluster.list_all_nodes()  # the first one is the head
        cluster.add_node(num_cpus=1)
        (lost,) = [place["pid"] for place in env.places() if place["node"] == node.node_id]
        cluster.remove_node(node, allow_graceful=False)
        os.kill(lost, signal.SIGKILL)  # it would go on for a moment


@pytest.mark.parametrize("victim", ["server", "actor", "node"])
def test_what_is_killed_goes_on_with_the_same_bits(cluster, undisturbed, victim):
    env = make(max_episode_steps=4)
    before = env.places()
    assert equal(play(env, lambda number: kill(env, cluster, victim) if number == 3 else None), undisturbed)
    assert env.recoveries >= 1 and env.replayed >= 4
    after = env.places()
    changed = [[old[key] != new[key] for old, new in zip(before, after)] for key in ("server_pid", "pid")]
    assert sum(changed[0]) == 1 and (sum(changed[1]) == 0) == (victim == "server"), "who lost a server starts another one"


def test_after_many_episodes_little_is_done_again_and_kept(cluster):
    """Nobody resets with seeds, as learners do not. The server is killed after each number of actions since a snapshot, amid
    episodes, where they end and where they begin, and once between a snapshot and the next action."""
    from drape.gym import DropFlat

    every, kills = 3, (30, 34, 38, 42, 43)
    env, alone = make(max_episode_steps=4, snapshot_every=every), DropFlat(ENVS, backend="cpu", max_episode_steps=4)
    mask = np.arange(ENVS) % 2 == 0
    replayed = []
    assert equal(env.reset(seed=5), alone.reset(seed=5))
    for number in range(46):
        if number in kills:
            kill(env, cluster, "server")
        before = env.replayed
        action = actions(number)[0]
        assert equal(env.step(action), alone.step(action)), number
        if number in kills:
            replayed.append(env.replayed - before)
        if number == 9:  # from now on they end at different times
            some = {"reset_mask": mask}
            assert equal(env.reset(options=some), alone.reset(options=some))
        assert max(map(len, env._history)) <= 1 + every
    alone.close()
    assert env.recoveries == len(kills) and set(replayed) == {0, 1, 2}


def test_a_server_that_is_lost_while_it_gives_a_snapshot_is_recovered(cluster, undisturbed, tmp_path):
    once = tmp_path / "once"

    def task(num_envs, **arguments):
        from drape.gym import DropFlat

        class Falling(DropFlat):
            def snapshot(self):
                with contextlib.suppress(FileExistsError):  # of two shards at the same time one
                    once.touch(exist_ok=False)
                    os.kill(self._owned._connection.server.pid, signal.SIGKILL)
                return super().snapshot()

        return Falling(num_envs, **arguments)

    env = make(task, max_episode_steps=4, snapshot_every=2)
    assert equal(play(env), undisturbed)
    assert env.recoveries == 1 and env.replayed == 2


def test_a_snapshot_goes_on_where_the_device_is_another_one_with_a_warning(cluster, undisturbed):
    def task(num_envs, **arguments):
        import drape
        from drape.gym import DropFlat

        class Elsewhere(DropFlat):  # which says so, though its bits are the same
            def restore(self, snapshot, *, inexact=False):
                if not inexact:
                    raise drape.FailedPrecondition("the snapshot is of another device", reason="OTHER_BUILD")
                super().restore(snapshot, inexact=True)

        return Elsewhere(num_envs, **arguments)

    env = make(task, max_episode_steps=4, snapshot_every=2)
    env.places()  # both are there
    with pytest.warns(RuntimeWarning, match="shard 1 goes on with other bits: OTHER_BUILD.*another device"):
        assert equal(play(env, lambda number: kill(env, cluster, "actor") if number == 3 else None), undisturbed)


def test_a_task_without_snapshots_keeps_its_history(cluster, undisturbed):
    def task(num_envs, **arguments):
        from drape.gym import DropFlat
        from gymnasium.vector import VectorWrapper

        return VectorWrapper(DropFlat(num_envs, **arguments))

    env = make(task, max_episode_steps=4, snapshot_every=2)
    assert equal(play(env, lambda number: kill_wrapped(env) if number == 3 else None), undisturbed)
    assert env.recoveries == 1 and env.replayed == 4 and max(map(len, env._history)) > 5


def kill_wrapped(env):
    os.kill(env.places()[1]["pid"], signal.SIGKILL)


@pytest.mark.parametrize("bad", [{"seed": -1}, {"seed": [1, 2, 3, 4, 5, -6]}, {"seed": [1]}, {"options": 3},
                                 {"options": {"mask": np.ones(ENVS, bool)}}, {"options": {"reset_mask": np.zeros(ENVS, bool)}}])
def test_a_refused_reset_changes_nothing(cluster, undisturbed, bad):
    """Neither what is seen nor what is done again after a loss."""
    env = make(max_episode_steps=4)

    def disturb(number):
        if number == 3:
            with pytest.raises((ValueError, TypeError), match="seed|options|reset_mask"):
                env.reset(**bad)
            kill(env, cluster, "server")

    assert equal(play(env, disturb), undisturbed)


def test_the_first_reset_is_of_all_and_can_be_done_again(cluster):
    env = make(max_episode_steps=4)
    mask = np.arange(ENVS) == 5
    begun, _ = env.reset(seed=[None, 1, 2, 3, 4, 5], options={"reset_mask": mask})
    assert len(np.unique(begun, axis=0)) == ENVS
    kill(env, cluster, "server")
    stay = np.zeros((ENVS, 8), np.float32)
    stay[:, [3, 7]] = 1
    after, *_ = env.step(stay)
    assert env.recoveries == 1 and np.abs(after - begun).max() < 0.1, "the same starts, a moment later"


def test_a_server_that_is_lost_once_more_costs_the_actor(cluster, undisturbed, tmp_path):
    """As when the machine is to blame."""
    log = tmp_path / "pids"

    def task(num_envs, **arguments):
        import drape
        from drape.gym import DropFlat

        with log.open("a") as file:
            print(os.getpid(), file=file)
        if log.read_text().splitlines().count(str(os.getpid())) > 1:
            raise drape.Unavailable("no server starts here any more")
        return DropFlat(num_envs, **arguments)

    env = make(task, max_episode_steps=4)
    before = env.places()
    assert equal(play(env, lambda number: kill(env, cluster, "server") if number == 3 else None), undisturbed)
    assert env.recoveries >= 2 and env.places()[1]["pid"] not in {place["pid"] for place in before}


def test_a_spare_takes_the_place_of_a_lost_actor(cluster, undisturbed):
    env = make(max_episode_steps=4, num_cpus=0.4, spares=1)
    env.await_spares()
    (spare,) = env._spares
    pid = ray_get(spare.is_ready)["pid"]
    assert equal(play(env, lambda number: kill(env, cluster, "actor") if number == 3 else None), undisturbed)
    assert env.recoveries == 1 and env.places()[1]["pid"] == pid
    env.await_spares()
    assert env._spares != [spare], "another one waits"


@pytest.mark.parametrize("spares", [1, 2])
def test_a_spare_without_room_does_not_keep_it_from_shards(cluster, undisturbed, spares):
    """Neither that of a shard that is made again, nor, in the beginning, that of the first ones: Ray may place whichever actor
    waits."""
    env = make(max_episode_steps=4, spares=spares)
    assert not env._spares, "before all shards have room"
    taken, take = [], env._take_spare

    def noted():
        taken.append((list(env._spares), take(), list(env._spares)))
        return taken[-1][1]

    env._take_spare = noted
    assert equal(play(env, lambda number: kill(env, cluster, "actor") if number == 3 else None), undisturbed)
    (before, chosen, after), = taken
    assert len(before) == spares and chosen == before[0].actor and not after, "nobody else waits for the room"
    assert len(env._spares) == spares, "others wait again"


def test_a_loss_is_noticed_while_other_shards_work(cluster, tmp_path):
    """The first shard does not answer before the recovery of the second one has begun."""
    has_begun = tmp_path / "begun"

    def task(num_envs, **arguments):
        from drape.gym import DropFlat

        class Waiting(DropFlat):
            def step(self, actions):
                end = time.monotonic() + 60
                while actions[0, 0] == 1 and not has_begun.exists():
                    assert time.monotonic() < end, "nobody noticed"
                    time.sleep(0.01)
                return super().step(actions)

        return Waiting(num_envs, **arguments)

    env = make(task)
    env.reset(seed=1)
    begin = env._begin

    def noted(k, method, *arguments):
        if method == "do_again":
            has_begun.touch()
        return begin(k, method, *arguments)

    env._begin = noted
    waits = np.zeros((ENVS, 8), np.float32)
    waits[0, 0] = 1
    kill(env, cluster, "actor")
    env.step(waits)
    assert env.recoveries == 1


def test_a_shard_that_is_lost_before_its_first_answer_is_made_again(cluster, undisturbed, tmp_path):
    begun = tmp_path / "begun"

    def task(num_envs, **arguments):
        from drape.gym import DropFlat

        if not begun.exists():
            begun.touch()
            os._exit(1)
        return DropFlat(num_envs, **arguments)

    env = make(task, max_episode_steps=4)
    assert equal(play(env), undisturbed)
    assert env.recoveries == 1 and env.replayed == 0


def test_what_the_task_raises_is_raised(cluster):
    def task(num_envs, **_):
        raise LookupError(f"no {num_envs} cloths here")

    with pytest.raises(LookupError, match="no 3 cloths here"):
        make(task)


def test_errors_of_the_caller_are_raised(cluster):
    env = make()
    env.reset(seed=1)
    with pytest.raises(ValueError, match="actions"):
        env.step(np.zeros((ENVS, 3)))
    with pytest.raises(ValueError, match="finite"):
        env.step(np.full((ENVS, 8), np.nan))
    with pytest.raises(ValueError, match="actions: numbers of the shape .* got object"):
        env.step(None)
    with pytest.raises(ValueError, match="actions: numbers of the shape .* got <U1"):
        env.step(np.full((ENVS, 8), "a"))
    assert env.recoveries == 0
    from drape.gym import DropFlat
    from drape.gym.shards import ShardedVectorEnv

    with pytest.raises(ValueError, match="shards"):
        ShardedVectorEnv(DropFlat, 2, shards=3)
    for num_envs, shards in ((2, 1.5), (2, "1"), (2.5, 1), ("2", 1)):
        with pytest.raises(ValueError, match="a whole number"):
            ShardedVectorEnv(DropFlat, num_envs, shards=shards)
    with pytest.raises(ValueError, match="num_gpus"):
        ShardedVectorEnv(DropFlat, 2, shards=1, num_gpus=2)
    with pytest.raises(ValueError, match="snapshot_every: .*got 0"):
        ShardedVectorEnv(DropFlat, 2, shards=1, snapshot_every=0)
