"""`./run bench python --case large`: large answers to a step, in one message and in chunks of 1 MiB.

Each way in a process of its own, in turn, against one server. wall_ms: p50 of a call. client_cpu_ms: per call.
client_mib: what the process had at most beyond what it had before the first answer; the arrays are among it.
"""

import json
import resource
import subprocess
import sys
import time

import numpy as np

import drape
import drape.cloths

PARTICLES = 1024
# cloths, calls of a round, whether one message can have them
SIZES = [(64, 200, True), (128, 100, True), (1000, 20, True), (5000, 6, True), (65_536, 2, False)]
ROUNDS = 3


def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure(address, cloths, calls, is_in_chunks):
    """What one process sees."""
    from client import cpu_s, sheet

    drape.cloths._CHUNKS_ABOVE_BYTES = 0 if is_in_chunks else 1 << 40
    with drape.connect(address) as client, client.session() as session:
        batch = session.create(sheet(), cloths)
        batch.step(view=None)
        before_mib = peak_mib()
        walls, total = [], 0.0
        for call in range(-1, calls):
            if call == 0:
                begin_s = cpu_s()
            begin = time.perf_counter()
            total += batch.step().positions[-1, -1, 1]
            if call >= 0:
                walls.append(1e3 * (time.perf_counter() - begin))
        return {"walls": walls, "cpu_ms": 1e3 * (cpu_s() - begin_s) / calls, "mib": peak_mib() - before_mib}


def large(client):
    """Rows of both ways."""
    rows = []
    for cloths, calls, fits in SIZES:
        ways = {"one message": False, "chunks": True} if fits else {"chunks": True}
        found = {way: [] for way in ways}
        for _ in range(ROUNDS if fits else 1):
            for way, is_in_chunks in ways.items():
                done = subprocess.run([sys.executable, __file__, client.address, str(cloths), str(calls), str(int(is_in_chunks))],
                                      check=True, capture_output=True, text=True)
                found[way].append(json.loads(done.stdout))
        for way in ways:
            rows.append({"states_mib": cloths * PARTICLES * 12 / 2**20, "way": way,
                         "wall_ms": float(np.median(sum((run["walls"] for run in found[way]), []))),
                         "client_cpu_ms": float(np.median([run["cpu_ms"] for run in found[way]])),
                         "client_mib": float(np.median([run["mib"] for run in found[way]]))})
    return rows


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], *map(int, sys.argv[2:4]), sys.argv[4] == "1")))
