#!/usr/bin/env python3
"""Self-collision beside that of NvCloth: nvcloth_contact.py RESULTS_DIR [CHECKOUT] writes RESULTS_DIR/contact_nvcloth.csv.

The sheets of `./run bench contact` that are no tube (nvcloth_contact.cpp), 32 x 32, one thread: time of the thread per frame (mean over the
frames, median of three plays), frames in which an edge crosses a triangle (counted exactly, by drape_bench), largest strain of the edges along
rows and columns. Ours and NvCloth's in turn, play after play. NvCloth keeps spheres around the particles apart: of the thickness of ours they
let everything through, so they are as large as cells. CHECKOUT: as for nvcloth.py. Ten minutes. Afterwards plots.py RESULTS_DIR shows the rows.
"""

import csv
import pathlib
import statistics
import subprocess
import sys
import tempfile

import contact_tables
import nvcloth
import rows

HERE = pathlib.Path(__file__).resolve()
BENCH = HERE.parents[2] / "build/release/bin/drape_bench"
SIDE, ROUNDS = 32, 3
SCENES = ["fold", "pile", "drape", "swing"]
ITERATIONS = [5, 10, 20, 50]
CELL_M = 1 / (SIDE - 1)
DISTANCES_M = [0.003, 0.8 * CELL_M, CELL_M]
SUBSTEPS, THICKNESS_M = [10, 20, 52], 0.003
# With -fstrict-aliasing GCC 12 makes a program of it that finds no collision in some runs.
FLAGS = ["-fno-strict-aliasing"]


def of_nvcloth(program, scene, iterations, distance_m, folder):
    positions = pathlib.Path(folder) / "positions.bin"
    out = subprocess.run([program, scene, str(SIDE), str(iterations), str(distance_m), positions], check=True, capture_output=True, text=True).stdout
    times = [float(line) for line in out.split()]
    out = subprocess.run([BENCH, "contact", f"--sides={SIDE}", f"--count-crossings={positions}"], check=True, capture_output=True, text=True).stdout
    frames = [line.split() for line in out.splitlines()]
    return {"ms": statistics.mean(times), "worst_ms": max(times), "frames": len(frames), "frames_with_crossings": sum(int(count) > 0 for count, _ in frames),
            "max_strain": max(float(strain) for _, strain in frames)}


def ours(scene, substeps, folder):
    subprocess.run([BENCH, f"--out={folder}", "contact", f"--scenes={scene}", f"--sides={SIDE}", "--counts=1", f"--substeps={substeps}",
                    f"--thickness-m={THICKNESS_M}"], check=True, capture_output=True)
    row = rows.read_table(folder, "contact", contact_tables.COLUMNS["contact"], contact_tables.TEXT_COLUMNS)[0]
    frames = rows.read_table(folder, "contact_frames", contact_tables.COLUMNS["contact_frames"], contact_tables.TEXT_COLUMNS)
    return {"ms": row["mean_ms"], "worst_ms": row["worst_ms"], "frames": len(frames), "frames_with_crossings": int(row["frames_with_crossings"]),
            "max_strain": row["max_strain"]}


def main():
    folder = pathlib.Path(sys.argv[1])
    if not folder.is_dir():
        sys.exit(f"no folder {folder}: RESULTS_DIR is where ./run bench contact wrote its tables")
    program = nvcloth.program_of(HERE.parent / "nvcloth_contact.cpp", sys.argv[2] if len(sys.argv) == 3 else None, FLAGS)
    with tempfile.TemporaryDirectory() as scratch:
        ways = {("Drape", substeps, THICKNESS_M): lambda scene, n=substeps: ours(scene, n, scratch) for substeps in SUBSTEPS}
        for distance_m in DISTANCES_M:
            for n in ITERATIONS:
                ways["NvCloth " + nvcloth.COMMIT, n, distance_m] = lambda scene, n=n, d=distance_m: of_nvcloth(program, scene, n, d, scratch)
        with open(folder / "contact_nvcloth.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(contact_tables.COLUMNS["contact_nvcloth"])
            for scene in SCENES:
                plays = {way: [] for way in ways}
                for number in range(ROUNDS):
                    print(f"{scene}: play {number + 1} of {ROUNDS}", flush=True)
                    for way, play in ways.items():
                        plays[way].append(play(scene))
                for (name, steps, thickness_m), found in plays.items():
                    values = [scene, name, steps, f"{1e3 * thickness_m:.4g}", *(f"{statistics.median(one[key] for one in found):.6g}" for key in (
                        "ms", "worst_ms", "frames", "frames_with_crossings", "max_strain"))]
                    writer.writerow(values)
                    file.flush()
                    print(*values, flush=True)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main()
