"""The part `crowds` of `./run bench service`: steps of which very much touches."""

import threading
import time

import drape
from drape import Box, ClothSpec, Collider, Grid

DISPATCH_MS = 50  # --batch-budget-us


def crowds(bench):
    """Steps of cloths that are all in one place, far more of which touches than can be computed, and of a cloth that lies on 200
    boxes with its edges: what a step takes, in time and memory, and the longest that a tenant with one sheet waited for a step
    of its own meanwhile."""
    # Cloths of 1 m: how many, their particles along an edge, their thickness, how far one is above the next [m].
    scenes = [(256, 8, 0.01, 0), (1024, 8, 0.01, 0), (1024, 8, 0.01, 0.001), (1, 64, 0.5, 0), (1, 1000, 1e6, 0), (2, 512, 0.01, 0)]
    for count, side, thickness_m, gap_m in scenes[:1] if bench.is_quick else scenes:
        if bench.backend == "gl" and (count > 1 or side > 100):
            continue  # worlds are stepped by cpu there, and larger ones have no kernels on llvmpipe
        spec = ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), self_collision={"thickness_m": thickness_m})
        case = f"{count} of {side} x {side}, {thickness_m:g} m thick" + (f", {gap_m:g} m apart" if gap_m else "")
        places = {"count": count, "world": "crowd" if count > 1 else "", "origins": [(0, k * gap_m, 0) for k in range(count)]}
        for report in (False, True):
            bench.add("crowds", case + (", with a report" if report else ""), **step_beside(bench, spec, places, report=report))
    if bench.backend == "gl":
        return  # the cores step what lies on its edges
    boxes = [Collider(box=Box(center_m=(k % 16 / 16, -0.081, k // 16 / 16), half_extents_m=(0.05, 0.08, 0.05))) for k in range(200)]
    side = 50 if bench.is_quick else 250
    spec = ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), environment={"colliders": boxes},
                     settings={"collider_contact": "SURFACE", "substeps": 20})
    bench.add("crowds", f"{side} x {side} on 200 boxes", **step_beside(bench, spec, {"count": 1}, steps=4))


def step_beside(bench, spec, places, steps=1, report=False):
    """So many steps of these cloths, in one request, beside those of a sheet."""
    with bench.draped(tenants=["modest", "crowded"]) as server:
        connect = lambda tenant: drape.connect(server.address, token=server.token_file(tenant).read_text(), timeout_s=600)
        with connect("modest") as modest, connect("crowded") as crowded, modest.session() as own, crowded.session() as other:
            sheet = own.create(ClothSpec(grid=Grid(columns=16, rows=16, width_m=1, height_m=1)))
            cloths = other.create(spec, **places)
            sheet.step(10)
            waits_ms, is_over, most_mb = [], threading.Event(), [0.0]

            def step_on():
                while not is_over.is_set():
                    begin = time.perf_counter()
                    sheet.step()
                    waits_ms.append(1e3 * (time.perf_counter() - begin))

            def look_at_memory():
                while not is_over.wait(0.1):
                    most_mb[0] = max(most_mb[0], server.resident_mb())

            beside = [threading.Thread(target=step_on), threading.Thread(target=look_at_memory)]
            for thread in beside:
                thread.start()
            time.sleep(1)
            begin = time.perf_counter()
            cloths.step(steps, report=report)
            step_s = (time.perf_counter() - begin) / steps
            is_over.set()
            for thread in beside:
                thread.join()
    return {"step_s": step_s, "longest_wait_ms": max(waits_ms), "dispatches": max(waits_ms) / DISPATCH_MS, "resident_mb": most_mb[0]}
