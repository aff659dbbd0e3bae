"""The Python client's side of client.py, a process of its own, as that of C++ is (burst.cpp): the allocator's settings are
those of a process. Its arguments are those of burst.cpp, but for the last.

python_client.py ADDRESS SIDE CLOTHS CALLS HAS_POSITIONS
"""

import json
import resource
import sys
import time

import drape
from drape import ClothSpec, Grid, Pin, StepSettings

SIDE = 32


def sheet(side=SIDE):
    """As in burst.cpp: one cheap sweep, so that the client counts."""
    return ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=side - 1)],
                     settings=StepSettings(substeps=1, max_iterations=1))


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def measure(address, side, cloths, calls, has_positions):
    """Wall times of the calls, and CPU time of this process in one [ms]."""
    with drape.connect(address) as client, client.session() as session:
        batch = session.create(sheet(side), cloths)
        view = drape.POSITIONS if has_positions else None
        walls, total = [], 0.0
        for call in range(-calls // 10, calls):
            if call == 0:
                begin_s = cpu_s()
            begin = time.perf_counter()
            answer = batch.step(view=view)
            if has_positions:
                total += answer.positions[-1, -1, 1]
            if call >= 0:
                walls.append(1e3 * (time.perf_counter() - begin))
        return {"wall_ms": walls, "cpu_ms": 1e3 * (cpu_s() - begin_s) / calls}


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], *(int(value) for value in sys.argv[2:6]))))
