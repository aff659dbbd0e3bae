"""`./run bench service`: what strangers can do to each other on one `draped`.

Writes results/DEVICE.md and a table beside it, part by part; with --parts, these parts of them. With --quick: short
windows and few cycles, results printed only.
"""

import argparse
import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import textwrap
import threading
import time

import drape
from drape import ClothSpec, Grid, Pin
from crowds import DISPATCH_MS, crowds
from draped import BIN, Beside, Draped, Proxy, load, load_command
from greedy import FLOODS
from tables import table, write_results

HERE = pathlib.Path(__file__).parent
GREEDY = [sys.executable, "-B", HERE / "greedy.py"]
TENANTS = 10
SHEET = ("--side", 16)
ROUNDS = 3
# Of tests/traffic/traffic_test.cpp.
TRAFFIC_FIGURES = ("operations", "cuts", "kills", "drains", "retries", "steps", "frames", "lost", "doubled", "findings", "oldest_checkpoint_ms")
ENDLESS = ("-p", 3_600_000)
BUSY = "two processes that only compute"


class Bench:
    def __init__(self, is_quick, backend):
        self.is_quick = is_quick
        self.backend = backend
        self.rows = []
        self.window = ("-p", 500, "-r", 3) if is_quick else ("-p", 5000, "-r", 5)

    def draped(self, *flags, **options):
        return Draped(*flags, backend=self.backend, **options)

    def add(self, part, case, **figures):
        self.rows.append({"part": part, "case": case, **figures})
        text = ", ".join(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in figures.items())
        print(f"{part}: {case}: {text}", flush=True)


def latency(level):
    return {"requests_per_s": level["requests_per_s"], "p50_ms": level["p50_ms"], "p99_ms": level["p99_ms"], "failed": int(level["failed"])}


def sessions(bench):
    """200 sessions of 8 cloths: one-step requests, each client again as soon as it is answered."""
    for clients in (1, 20, 200):
        with bench.draped() as server:
            level = load(server, *SHEET, "--cloths", 8, f"--concurrency-range={clients}", *bench.window)
            bench.add("sessions", f"{clients} x 8 cloths", **latency(level), p99_per_p50=level["p99_ms"] / level["p50_ms"])


def requests(bench):
    """What requests cost beside steps: 64 clients with one cloth of four particles each. The server's processor time is that of
    all its threads."""
    count = 500 if bench.is_quick else 40_000
    with bench.draped() as server:
        flags = ("--side", 2, "--concurrency-range=64", "-r", 1, "-p", 3_600_000)
        load(server, *flags, f"--request-count={count // 10}")
        before_s = server.processor_s()
        level = load(server, *flags, f"--request-count={count}")
        bench.add("requests", "64 x 1 cloth", server_us=1e6 * (server.processor_s() - before_s) / count, **latency(level))


def viewers(bench):
    """Steps per second with viewers that read, that do not, and that vanish, in turn with none."""
    kinds = {"none": (), "4 at 50 Hz": ("--viewers", 4), "4 that do not read": ("--stalled-viewers", 4)}
    found = {kind: [] for kind in kinds}
    with bench.draped() as server:
        for _ in range(1 if bench.is_quick else ROUNDS):
            for kind, flags in kinds.items():
                found[kind].append(load(server, "--side", 32, "--cloths", 16, "--concurrency-range=4", *flags, *bench.window))
    base = statistics.median(level["requests_per_s"] for level in found["none"])
    for kind, levels in found.items():
        rate = statistics.median(level["requests_per_s"] for level in levels)
        age = statistics.median(level["frame_age_p95_ms"] for level in levels)
        bench.add("viewers", kind, requests_per_s=rate, change_percent=100 * (rate / base - 1), frame_age_p95_ms=age,
                  failed=int(sum(level["failed"] for level in levels)))


# Options of Cloths.frames; None: no viewers.
VIEWERS = {"4 of the latest, stalled": {}, "4 of every frame, stalled": {"every_frame": True}, "4 that vanished": {},
           "4 that read at 50 Hz": {"max_hz": 50}, "none, for comparison": None}


def stalled(bench):
    """What viewers cost that do not read, or have vanished: processor time of the whole server per step of 16 cloths of
    1024 particles. Steps with and without them take turns, and each pair is a ratio: what else the machine does in the
    meantime takes from neither. Median of the ratios; error_percent is that of the median, 1.25 times the deviation of a
    ratio (1.48 times their median distance from it) over the root of their number."""
    pairs, steps = (4, 20) if bench.is_quick else (60, 60)
    spec = ClothSpec(grid=Grid(columns=32, rows=32, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=31)])
    # A viewer of every frame that does not read ends when 16 MiB of them wait: after 85.
    longer = [(kind, 5 * steps) for kind in VIEWERS if "every frame" in kind]
    for kind, steps in [(kind, steps) for kind in VIEWERS] + longer:
        with bench.draped("--threads=1") as server, drape.connect(server.address) as client, client.session() as session:
            cloths = session.create(spec, 16)
            cloths.step(100, view=None)
            ratios = []
            for k in range(pairs):
                cost_s = {}
                for is_viewed in (k % 2 == 0, k % 2 == 1):
                    with viewers_of(cloths, kind if is_viewed else "none, for comparison"):
                        cloths.step(10, view=None)
                        before_s = server.processor_s()
                        cloths.step(steps, view=None)
                        cost_s[is_viewed] = server.processor_s() - before_s
                ratios.append(cost_s[True] / cost_s[False])
        middle = statistics.median(ratios)
        deviation = 1.48 * statistics.median(abs(ratio - middle) for ratio in ratios)
        bench.add("stalled", kind, steps=steps, change_percent=100 * (middle - 1), error_percent=125 * deviation / len(ratios) ** 0.5)


def audience(bench):
    """What viewers of the same cloths cost together: processor time of the whole server per step of 16 cloths of 1024 particles,
    after which each viewer, with a connection of its own, reads the frame. Without them, and with 1, 8 and 32, by turns."""
    rounds, steps = (2, 5) if bench.is_quick else (12, 20)
    counts = (0, 1, 8, 32)
    spec = ClothSpec(grid=Grid(columns=32, rows=32, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=31)])
    with bench.draped("--threads=1") as server, drape.connect(server.address) as client, client.session() as session:
        cloths = session.create(spec, 16)
        cloths.step(100, view=None)
        costs_ms = {count: [] for count in counts}
        for _ in range(rounds):
            for count in counts:
                with contextlib.ExitStack() as stack:
                    viewers = []
                    for _ in range(count):
                        own = stack.enter_context(drape.connect(server.address)).session(name=session.name).attach()
                        viewers.append(stack.enter_context(own.frames(every_frame=True, queue_frames=8)))
                    for viewer in viewers:
                        next(viewer)
                    before_s = server.processor_s()
                    for _ in range(steps):
                        cloths.step(1, view=None)
                        for viewer in viewers:
                            next(viewer)
                    costs_ms[count].append(1000 * (server.processor_s() - before_s) / steps)
    none = statistics.median(costs_ms[0])
    for count, costs in costs_ms.items():
        per_viewer = {"per_viewer_ms": (statistics.median(costs) - none) / count} if count else {}
        bench.add("audience", f"{count} viewers", server_ms=statistics.median(costs), **per_viewer)


@contextlib.contextmanager
def viewers_of(cloths, kind):
    """Four viewers, each of which has read its first frame."""
    options = VIEWERS[kind]
    viewers = [] if options is None else [cloths.frames(**options) for _ in range(4)]
    for viewer in viewers:
        next(viewer)
    readers = [threading.Thread(target=read_to_the_end, args=(viewer,)) for viewer in viewers if "max_hz" in options]
    for reader in readers:
        reader.start()
    if "vanished" in kind:
        for viewer in viewers:
            viewer.close()
    try:
        yield
    finally:
        for viewer in viewers:
            viewer.close()
        for reader in readers:
            reader.join()


def read_to_the_end(viewer):
    try:
        for _ in viewer:
            pass
    except drape.Cancelled:
        pass


def neighbours(bench):
    """A tenant with one cloth, alone and beside tenants that take what they get."""
    others = [f"greedy-{k}" for k in range(TENANTS)]
    few = 400 if bench.is_quick else 4000
    side = 200 if bench.is_quick else 1000
    def crowd(server):
        return [load_command(server, "--side", 8, "--cloths", few, "--request-timeout", 600, *ENDLESS, tenant=other) for other in others]

    def large(server):
        return [load_command(server, "--side", side, "--request-timeout", 600, *ENDLESS, tenant=others[0])]

    def builds(server):
        return [[*GREEDY, "builds", server.address, server.token_file(others[0])]]

    def busy(server):
        return [[*GREEDY, "busy", server.address]] * 2

    def meshes(server):
        return [[*GREEDY, "meshes", server.address, server.token_file(others[0])]]

    def sessions_without_end(server):
        return [load_command(server, "--request=session", "--side", 8, "--concurrency-range=16", *ENDLESS, tenant=others[0])]

    cases = {"nobody": lambda _: [], BUSY: busy, f"{TENANTS} tenants with {few} cloths each": crowd,
             f"a cloth of {side * side} particles": large, "colliders of 131 072 triangles": builds,
             "cloths of 999 698 triangles": meshes, "16 clients that make sessions": sessions_without_end}
    undisturbed_ms = None
    for case, commands in cases.items():
        with bench.draped(tenants=["modest", *others]) as server:
            with Beside(commands(server), settle_s=3 if bench.is_quick else 15):
                level = load(server, *SHEET, "--concurrency-range=1", "--request-timeout", 600, *bench.window, tenant="modest")
                undisturbed_ms = undisturbed_ms or level["p99_ms"]
                bench.add("neighbours", case, **latency(level), p99_per_undisturbed=level["p99_ms"] / undisturbed_ms,
                          dispatches=level["p99_ms"] / DISPATCH_MS, resident_mb=server.resident_mb())


def creations(bench):
    """A tenant that makes and deletes one small cloth after the other, alone and beside tenants who keep the builders busy."""
    others = ["greedy-0", "greedy-1"]
    def builds(count):
        return lambda server: [[*GREEDY, "builds", server.address, server.token_file(other)] for other in others[:count]]

    cases = {"nobody": lambda _: [], BUSY: lambda server: [[*GREEDY, "busy", server.address]] * 2,
             "colliders of 131 072 triangles": builds(1), "the same of two tenants": builds(2)}
    undisturbed_ms = None
    for case, commands in cases.items():
        with bench.draped(tenants=["modest", *others]) as server:
            with Beside(commands(server), settle_s=3 if bench.is_quick else 10):
                level = load(server, "--request=create", "--side", 4, "--concurrency-range=1", "--request-timeout", 600, *bench.window, tenant="modest")
                undisturbed_ms = undisturbed_ms or level["p99_ms"]
                bench.add("creations", case, **latency(level), p99_per_undisturbed=level["p99_ms"] / undisturbed_ms)


def fairness(bench):
    """Tenants with 1, 2, 4 and 8 clients, each of which asks for more than a batch holds, eight steps at a time: the moments
    in which the one client asks for nothing hardly count. Cloth-steps per second of equal cloths; each tenant is measured
    while the others go on."""
    clients = {f"with-{count}": count for count in (1, 2, 4, 8)}
    shares = []
    for measured, count in clients.items():
        with bench.draped(tenants=clients) as server:
            sheets = lambda n: ("--side", 32, "--cloths", 200, "--steps", 8, f"--concurrency-range={n}", "--request-timeout", 600)
            others = [load_command(server, *sheets(n), *ENDLESS, tenant=t) for t, n in clients.items() if t != measured]
            with Beside(others, settle_s=3):
                window = ("-p", 5000 if bench.is_quick else 30_000, "-r", 1, "--warmup-request-count", 1)
                shares.append(load(server, *sheets(count), *window, tenant=measured)["cloth_steps_per_s"])
        bench.add("fairness", f"tenant {measured} clients", cloth_steps_per_s=shares[-1])
    bench.add("fairness", "all", jain=sum(shares) ** 2 / (len(shares) * sum(share**2 for share in shares)))


def saved(bench):
    """States of 64 cloths that the server saves and loads by name (SaveStates, LoadStates), as a search for actions does: a step
    between two of them. A step of the same cloths for comparison."""
    rounds = 5 if bench.is_quick else 200
    for side in (16, 32):
        spec = ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=side - 1)])
        calls = {"save": lambda: cloths.save("point"), "load": lambda: cloths.load("point"), "step": lambda: cloths.step(1)}
        times_ms = {call: [] for call in calls}
        with bench.draped() as server, drape.connect(server.address) as client:
            cloths = client.session().create(spec, 64)
            for _ in range(rounds):
                for name, call in calls.items():
                    begin = time.perf_counter()
                    call()
                    times_ms[name].append(1e3 * (time.perf_counter() - begin))
        for name, times in times_ms.items():
            ordered = sorted(times)
            bench.add("saved", f"{name} 64 cloths of {side * side} particles", p50_ms=statistics.median(ordered),
                      p95_ms=ordered[int(0.95 * len(ordered))])


def memory(bench):
    """Resident memory of the server over cloths and sessions that come and go. Request ids are kept for a second: with the
    default memory grows by what they need until the first are 10 minutes old."""
    cycles = 300 if bench.is_quick else 100_000
    with bench.draped("--request-ids-kept-us=1000000") as server:
        for request in ("create", "session"):
            run = lambda count: load(server, *SHEET, f"--request={request}", "--concurrency-range=4", f"--request-count={count}", "-r", 1,
                                     "-p", 3_600_000)
            run(cycles // 5)
            before = server.resident_mb()
            level = run(cycles)
            after = server.resident_mb()
            bench.add("memory", f"{request}, {cycles} times", before_mb=before, after_mb=after, growth_percent=100 * (after / before - 1),
                      **latency(level))


def states(bench):
    """Resident memory of the server for the states of cloths, by their size, each with a server of its own: created and
    stepped once, beside two cloths of the same model. `--max-state-bytes` counts 8192 bytes for each and 160 for a particle, and
    256 more for a particle of a cloth in a world."""
    free = ((2, 30_000, 0), (16, 4096, 0), (32, 1024, 0), (128, 64, 0), (512, 4, 0))
    for side, count, per_world in (*free, (2, 32_000, 64), (16, 4096, 64), (32, 1024, 4), (128, 64, 64), (512, 4, 2)):
        spec = ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), pins=[Pin(particle=0)])
        count = max(1, count // 8) if bench.is_quick else count
        per_world = min(per_world, count)
        with bench.draped() as server, drape.connect(server.address) as client, client.session() as session:
            session.create(spec, 2).step(view=None)
            before_mb = server.resident_mb()
            batches = [session.create(spec, per_world or count, world=f"from {first}" if per_world else "",
                                      origins=[(0, 0.1 * k, 0) for k in range(per_world)] or None)
                       for first in range(0, count, per_world or count)]
            session.step(batches)
            taken_bytes = (server.resident_mb() - before_mb) * 1024_000  # of 1000 KiB each
        particles = count * side**2
        counted_bytes = 8192 * count + (160 + (256 if per_world else 0)) * particles
        worlds = f" in worlds of {per_world}" if per_world else ""
        bench.add("states", f"{count} cloths of {side * side} particles{worlds}", bytes_per_cloth=taken_bytes / count,
                  bytes_per_particle=taken_bytes / particles, of_what_counts=taken_bytes / counted_bytes)


def floods(bench):
    """Memory, and the latency of an undisturbed client's Step, while two clients of another address flood the server, and
    while they flood it through the proxy of docker/exposed. Without the proxy the server may take 12 GB of memory."""
    undisturbed_ms = {}
    for kind in ("nobody", "busy", *FLOODS):
        for is_behind in (False, True):
            with contextlib.ExitStack() as running:
                server = running.enter_context(
                    bench.draped("--max-connections-per-peer=0") if is_behind else bench.draped(max_memory_gb=12))
                proxy = running.enter_context(Proxy(server.address)) if is_behind else None
                address = (proxy or server).address
                commands = [] if kind == "nobody" else [[*GREEDY, kind, address]] * 2
                running.enter_context(Beside(commands, settle_s=1 if bench.is_quick else 5))
                try:
                    level = load(server, *SHEET, "--concurrency-range=1", *bench.window, address=address)
                    undisturbed_ms.setdefault(is_behind, level["p99_ms"])
                    figures = {**latency(level), "p99_per_undisturbed": level["p99_ms"] / undisturbed_ms[is_behind]}
                except RuntimeError:  # nobody else gets in
                    figures = {"failed": "all"}
                if proxy:
                    figures["proxy_mb"] = proxy.resident_mb()
                if server.is_alive:
                    figures["resident_mb"] = server.resident_mb()
                bench.add("floods", (BUSY if kind == "busy" else kind.replace("_", " ")) + (", behind HAProxy" if proxy else ""), **figures,
                          alive=int(server.is_alive))


def restart(bench):
    """A server with checkpoints is killed: seconds until a new one has its session again, and whether the bits are those of
    the checkpoint."""
    for cloths in (64,) if bench.is_quick else (64, 1000, 8000):
        with tempfile.TemporaryDirectory(prefix="drape-bench-") as folder:
            flags = (f"--checkpoint-dir={folder}", "--checkpoint-interval-s=0.5")
            spec = ClothSpec(grid=Grid(columns=32, rows=32, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=31)])
            with bench.draped(*flags) as server:
                with drape.connect(server.address) as client:
                    session = client.session()
                    name = session.name
                    batch = session.create(spec, cloths)
                    batch.step(3)
                    size = settled_bytes(folder)
                    before = batch.read().positions.tobytes()
                    server.kill()
            begin = time.perf_counter()
            with bench.draped(*flags) as server, drape.connect(server.address) as client:
                after = client.session(name=name).attach().read()
                ready_s = time.perf_counter() - begin
                bench.add("restart", f"{cloths} x 1024", megabytes=size / 1e6, ready_s=ready_s,
                          same_bits=int(after.positions.tobytes() == before))


def traffic(bench):
    """Random clients through cut connections of a server that is killed, against a model (tests/traffic): steps of cloths that
    were acknowledged, and how many of them were lost or done twice; retries of the clients; the age of the last checkpoints
    at the worst kill (--checkpoint-interval-s 0.2)."""
    case = "Traffic.NothingIsLostOrDoubledOverCutsAndKills" if bench.is_quick else "TrafficLong.HundredThousandOperations"
    with tempfile.TemporaryDirectory(prefix="drape-bench-") as folder:
        report = pathlib.Path(folder) / "report.json"
        begin = time.perf_counter()
        done = subprocess.run([BIN / "traffic_test", f"--gtest_filter={case}", f"--gtest_output=json:{report}"], stdout=subprocess.PIPE,
                              text=True, check=False)
        if done.returncode != 0:
            print(done.stdout, file=sys.stderr)
        told = json.loads(report.read_text())["testsuites"][0]["testsuite"][0]
        bench.add("traffic", case.rpartition(".")[2], **{name: int(told[name]) for name in TRAFFIC_FIGURES},
                  seconds=time.perf_counter() - begin)


def settled_bytes(folder):
    """Bytes of the checkpoints, once two seconds, four intervals, have passed without a change of them."""
    looks = lambda: {path: (path.stat().st_mtime_ns, path.stat().st_size) for path in pathlib.Path(folder).glob("*.checkpoint")}
    last = looks()
    while True:
        time.sleep(2)
        now = looks()
        if now and now == last:
            return sum(size for _, size in now.values())
        last = now


PARTS = {part.__name__: part
         for part in (sessions, requests, viewers, stalled, audience, neighbours, crowds, creations, fairness, saved, memory, states, floods, restart, traffic)}


def measure(bench, part):
    load_before, begin = os.getloadavg()[0], time.monotonic()
    PARTS[part](bench)
    seconds = time.monotonic() - begin
    with bench.draped() as server, drape.connect(server.address) as client:
        device = client.info.device
    command = f"./run bench service --parts={part}" + ("" if bench.backend == "cpu" else f" --backend={bench.backend}")
    meaning = textwrap.fill(" ".join(PARTS[part].__doc__.split()), 120)
    source = textwrap.fill(f"By `{command}`; {device}; load average before {load_before:.1f}; {seconds:.0f} s.", 120)
    rows = [row for row in bench.rows if row["part"] == part]
    text = f"## {part}\n\n{meaning}\n\n{table(rows)}\n{source}\n"
    print(text, flush=True)
    if not bench.is_quick:
        write_results(HERE / "results", PARTS, part, rows, text, device if bench.backend == "cpu" else f"{bench.backend} {device}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--parts", default=",".join(PARTS), help=f"of {', '.join(PARTS)} (default: all)")
    parser.add_argument("--backend", default="cpu", help="of the servers: cpu, gl or reference (default: cpu)")
    arguments = parser.parse_args()
    wanted = arguments.parts.split(",")
    unknown = [part for part in wanted if part not in PARTS]
    if unknown:
        parser.error(f"--parts: unknown {unknown[0]} (legal: {', '.join(PARTS)})")
    bench = Bench(arguments.quick, arguments.backend)
    for part in wanted:
        measure(bench, part)


if __name__ == "__main__":
    main()
