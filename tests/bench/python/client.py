"""`./run bench python`: the Python client beside the C++ client, in turn against one server; the vector environments;
and sheets of other simulators.

Writes results/MACHINE.md and the tables beside it. With --quick: few calls, no other simulators, results printed only.
With --case NAME: that comparison alone, printed only; `envs` is that of the vector environments, `pictures` one of
pictures, `impulses` of steps that tell their impulses, `large` of large answers in one message and in chunks, `peers` of
other simulators, `sizes` of cloths of unlike sizes. `viewer` (windows of `drape.viewer`), `ray` (shards on Ray), `recoveries` (of shards whose server,
actor or node is killed) and `proxy` (calls through HAProxy) also write their table into results/. --device: of Newton,
as Warp calls it.
"""

import argparse
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import time

import numpy as np
import peers  # these five are beside this file
import proxy
import sizes
from large_answers import large
from python_client import SIDE, cpu_s, sheet

import drape
from drape import ClothSpec, Grid, Pin, StepSettings

ROOT = pathlib.Path(__file__).resolve().parents[3]
PEERS_PYTHON = ROOT / "build/peers-environment/bin/python"
CPP = os.environ.get("DRAPE_BURST", ROOT / "build/release/bin/drape_burst")
PYTHON_SIDE = pathlib.Path(__file__).with_name("python_client.py")
# Name, particles along an edge, cloths, whether with positions, calls per round.
CASES = [("empty Step", 2, 1, False, 1000), ("1 x 1024, acknowledged", SIDE, 1, False, 400),
         ("64 x 1024, positions", SIDE, 64, True, 200), ("1000 x 1024, positions", SIDE, 1000, True, 20)]
ROUNDS = 5
ENVS, ACTIONS = 64, 12
TILE_PX = 128
TICK_S = 1 / 100  # of /proc/PID/stat


def server_cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def by_python(client, mallopt, *request):
    environment = {**os.environ, "DRAPE_MALLOPT": str(int(mallopt))}
    done = subprocess.run([sys.executable, "-B", PYTHON_SIDE, client.address, *(str(int(value)) for value in request)],
                          check=True, capture_output=True, text=True, env=environment)
    found = json.loads(done.stdout)
    return found["wall_ms"], found["cpu_ms"]


def by_cpp(client, mallopt, *request):
    done = subprocess.run([CPP, client.address, *(str(int(value)) for value in request), str(int(mallopt))],
                          check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    return found["wall_ms"], found["cpu_ms"]


def compare(client, is_quick, wanted=""):
    """Rows of the clients: every case whose name begins so by the clients in turn, ROUNDS times, each time in a process of
    its own."""
    rows = []
    for name, side, cloths, has_positions, calls in CASES:
        if not name.startswith(wanted):
            continue
        calls = max(10, calls // 20) if is_quick else calls
        request = side, cloths, calls, has_positions
        contestants = {
            "Python": lambda: by_python(client, True, *request),
            "Python, DRAPE_MALLOPT=0": lambda: by_python(client, False, *request),
            "C++": lambda: by_cpp(client, False, *request),
            "C++, mallopt": lambda: by_cpp(client, True, *request)}
        walls, cpus = {key: [] for key in contestants}, {key: [] for key in contestants}
        for _ in range(1 if is_quick else ROUNDS):
            for key, run in contestants.items():
                wall, cpu = run()
                walls[key] += wall
                cpus[key].append(cpu)
        for key in contestants:
            p10, p50 = np.percentile(walls[key], [10, 50])
            base10, base50 = np.percentile(walls["C++, mallopt"], [10, 50])
            rows.append({"case": name, "client": key, "calls": len(walls[key]), "p10_ms": p10, "p50_ms": p50,
                         "p10_ratio": p10 / base10, "p50_ratio": p50 / base50, "client_cpu_ms": np.median(cpus[key])})
    return rows


def pictures(client):
    """Rows of pictures: one of each of ENVS cloths, in as many calls or as tiles of one, in turn."""
    rows = []
    camera = drape.Camera(eye_m=[0.5, 0.8, 2.2], target_m=[0.5, -0.4, 0.5])
    with client.session() as session:
        batch = session.create(sheet(), ENVS)
        batch.step(30, view=None)
        pid = client._connection.server.pid
        ways = {"calls": lambda: [batch.render(TILE_PX, TILE_PX, ids=[k], camera=camera) for k in range(ENVS)],
                "tiles": lambda: batch.render_tiles(TILE_PX, TILE_PX, camera)}
        walls, cpus = {way: [] for way in ways}, {way: [] for way in ways}
        for _ in range(ROUNDS):
            for way, draw in ways.items():
                begin, begin_s = time.perf_counter(), server_cpu_s(pid)
                draw()
                walls[way].append(1e3 * (time.perf_counter() - begin))
                cpus[way].append(1e3 * (server_cpu_s(pid) - begin_s))
        for way in ways:
            rows.append({"way": way, "pictures": ENVS, "edge_px": TILE_PX, "wall_ms": np.median(walls[way]),
                         "server_cpu_ms": np.median(cpus[way])})
    return rows


def impulses(client):
    """Rows of steps that tell their impulses beside steps that do not, in turn: ENVS fabrics by the preset REALTIME."""
    fabric = dict(grid=Grid(columns=SIDE, rows=SIDE, width_m=1, height_m=1),
                  material=drape.Material(bending_rigidity_n_m=1e-5, friction_static=0.5, friction_dynamic=0.4),
                  settings=StepSettings(sleep_motion_m=0))
    ball = drape.Environment(colliders=[drape.Collider(sphere=drape.Sphere(center_m=[0.5, -0.35, 0.5], radius_m=0.3))])
    corners, edge = [Pin(particle=0), Pin(particle=31)], [Pin(particle=k) for k in range(SIDE)]
    cases = {"hung by corners": ClothSpec(pins=corners, **fabric), "hung by an edge": ClothSpec(pins=edge, **fabric),
             "on a ball": ClothSpec(environment=ball, **fabric), "held by a grip": ClothSpec(max_grips=1, **fabric)}
    rows = []
    pid = client._connection.server.pid
    for name, spec in cases.items():
        with client.session() as session:
            batch = session.create(spec, ENVS)
            if spec.max_grips:
                batch.grip(0, particles=[0])
            batch.step(40, view=None)
            cpus = {False: [], True: []}
            for _ in range(4 * ROUNDS):
                for asks in cpus:
                    begin_s = server_cpu_s(pid)
                    for _ in range(10):
                        batch.step(view=None, impulses=asks)
                    cpus[asks].append(1e3 * (server_cpu_s(pid) - begin_s) / 10)
            plain, asked = (np.median(cpus[asks]) for asks in (False, True))
            rows.append({"cloths": f"{ENVS} x {SIDE * SIDE}, {name}", "plain_cpu_ms": plain, "asked_cpu_ms": asked,
                         "ratio": asked / plain})
    return rows


def environments(is_quick):
    """Rows of the environments: CPU of client and server per action, and actions of environments per second."""
    import drape.gym
    from drape.gym import scripted

    rows = []
    for task, policy in ((drape.gym.DropFlat, scripted.lay_down), (drape.gym.FlingFlat, scripted.fling),
                         (drape.gym.CoverSphere, scripted.cover), (drape.gym.FoldHalf, scripted.fold),
                         (drape.gym.Flatten, scripted.spread), (drape.gym.Hang, scripted.hang)):
        envs, actions = (8, 3) if is_quick else (ENVS, ACTIONS)
        env = task(envs, backend="cpu")
        env.reset(seed=1)
        env.step(policy(env))
        pid = env._owned._connection.server.pid
        mine, theirs, wall = 0.0, server_cpu_s(pid), 0.0
        for _ in range(actions):
            action = policy(env)  # not counted: a learner's own time
            begin, begin_cpu = time.perf_counter(), cpu_s()
            env.step(action)
            wall += time.perf_counter() - begin
            mine += cpu_s() - begin_cpu
        theirs = server_cpu_s(pid) - theirs
        env.close()
        rows.append({"task": task.__name__, "envs": envs, "steps_per_action": task.action_repeat,
                     "wall_ms": 1e3 * wall / actions, "server_cpu_ms": 1e3 * theirs / actions,
                     "client_cpu_ms": 1e3 * mine / actions, "client_share": mine / theirs,
                     "env_steps_per_s": envs * actions / wall,
                     "env_steps_per_server_cpu_s": envs * actions / theirs})
    return rows


def viewer(client):
    """Rows of windows that play: pictures that reach a browser's socket, which nothing draws, and what one costs."""
    from viewer_rate import measure  # viser takes a second to import

    rows = []
    for settings in ("one sweep", "REALTIME"):
        for cloths, side in ((10, SIDE), (1, 8 * SIDE)):
            spec = sheet()
            spec.grid.columns = spec.grid.rows = side
            spec.pins[1].particle = side - 1
            if settings == "REALTIME":
                spec.settings.CopyFrom(StepSettings(preset=StepSettings.REALTIME))
            with client.session() as session:
                batch = session.create(spec, cloths, origins=[[2.0 * k, 0, 0] for k in range(cloths)])
                rows.append({"cloths": cloths, "particles": side * side, "settings": settings, **measure(batch, cpu_s)})
    return rows


def shards(what, is_quick):
    import ray_shards  # `./run bench python --case ray` installs Ray

    return getattr(ray_shards, what)(is_quick)


def of_peers(device):
    return peers.of_all(PEERS_PYTHON, server_cpu_s, device)


def table(rows):
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for row in rows:
        lines.append("| " + " | ".join(f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()) + " |")
    return "\n".join(lines) + "\n"


def write_csv(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--case", choices=[*(case[0] for case in CASES), "envs", "pictures", "impulses", "viewer", "large",
                                             "peers", "sizes", "ray", "recoveries", "proxy"], default="")
    parser.add_argument("--device", default="auto")
    arguments = parser.parse_args()
    with drape.launch("cpu") as client:
        device = client.info.device
        of_case = {"envs": lambda _: environments(arguments.quick), "pictures": pictures, "impulses": impulses, "viewer": viewer,
                   "large": large, "peers": lambda _: of_peers(arguments.device),
                   "sizes": lambda client: sizes.measure(client, arguments.quick),
                   "ray": lambda _: shards("overhead", arguments.quick),
                   "recoveries": lambda _: shards("recoveries", arguments.quick),
                   "proxy": lambda _: proxy.measure(arguments.quick)}.get(arguments.case)
        clients = of_case(client) if of_case else compare(client, arguments.quick, arguments.case)
    folder = pathlib.Path(__file__).with_name("results")
    machine = re.sub(r"[^a-z0-9]+", "-", device.lower()).strip("-")
    if arguments.case:
        print(f"{device}; load average {os.getloadavg()[0]:.1f}\n\n{table(clients)}")
        if arguments.case in ("viewer", "ray", "recoveries", "proxy") and not arguments.quick:
            write_csv(folder / f"{machine}_{arguments.case}.csv", clients)
        return 0
    envs = environments(arguments.quick)
    text = (f"# The Python client\n\nBy `./run bench python`; {device}; load average {os.getloadavg()[0]:.1f} (ratios are of\n"
            f"runs in turn, so they stand a busy machine; wall times do not).\n\n## Beside the C++ client\n\n" + table(clients)
            + "\n## Vector environments\n\n" + table(envs))
    if arguments.quick:
        print(text)
        return 0
    others = of_peers(arguments.device)
    text += "\n## Beside other simulators\n\n" + table(others)
    print(text)
    write_csv(folder / f"{machine}_clients.csv", clients)
    write_csv(folder / f"{machine}_envs.csv", envs)
    write_csv(folder / f"{machine}_peers.csv", others)
    (folder / f"{machine}.md").write_text(text)
    print(f"results are in {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
