#!/usr/bin/env python3
"""Self-collision with NvCloth, beside Drape: nvcloth_contact.py RESULTS_DIR [CHECKOUT] writes RESULTS_DIR/contact_nvcloth.csv.

Both play the scenes of `drape_bench contact` (32x32 particles, one cloth, one thread) in one run. NvCloth keeps particles apart by a
distance: that of Drape's thickness, and distances up to what the spacing of the sheet's particles allows. Its iterations are those that
take it about as long as Drape, and fewer. Crossings are counted by Drape's exact test for both, in every frame. CHECKOUT: see nvcloth.py.
Needs build/release/bin/drape_bench. Not part of ./run bench.
"""

import csv
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import nvcloth  # noqa: E402

BENCH = HERE.parents[2] / "build/release/bin/drape_bench"
SCENES = ["fold", "pile", "twist", "drape"]
ITERATIONS = [5, 10, 20, 52]
DISTANCES_MM = [0, 3, 16, 30]  # the edges of the sheet are 32 mm long; 0: no self-collision
ROUNDS = 3
COLUMNS = ["scene", "program", "iterations", "distance_mm", "mean_ms", "worst_ms", "frames_with_crossings", "most_crossings", "max_strain"]


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def drape(folder, *flags):
    subprocess.run([BENCH, f"--out={folder}", "contact", "--sides=32", "--counts=1", f"--scenes={','.join(SCENES)}", *flags], check=True)


def measure(program, path):
    with tempfile.TemporaryDirectory(prefix="drape-nvcloth-") as name:
        folder = pathlib.Path(name)
        plays, positions = folder / "plays", folder / "positions"
        plays.mkdir()
        positions.mkdir()
        ours, theirs = [], {}
        for number in range(ROUNDS):
            drape(folder / f"drape{number}", f"--plays={plays}")
            ours.append({row["scene"]: row for row in rows_of(folder / f"drape{number}" / "contact.csv")})
            for scene in SCENES:
                for iterations in ITERATIONS:
                    for distance_mm in DISTANCES_MM:
                        label = f"{iterations}_{distance_mm}"
                        out = subprocess.run([program, plays / f"{scene}.play", positions / f"{scene}.{label}.positions", str(iterations),
                                              str(distance_mm / 1000)], check=True, capture_output=True, text=True).stdout
                        theirs.setdefault((scene, label), []).append([float(word) for word in out.split()])
        drape(folder / "peers", f"--peers={positions}")
        counted = {(row["scene"], row["label"]): row for row in rows_of(folder / "peers" / "contact_peers.csv")}
        with open(path, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            for scene in SCENES:
                of_scene = [one[scene] for one in ours]
                median = {key: statistics.median(float(row[key]) for row in of_scene) for key in ("mean_ms", "worst_ms", "bare_mean_ms")}
                first = of_scene[0]
                writer.writerow([scene, "Drape without", first["substeps"], "", f"{median['bare_mean_ms']:.4g}", "", "", "", ""])
                writer.writerow([scene, "Drape", first["substeps"], float(first["thickness_mm"]), f"{median['mean_ms']:.4g}", f"{median['worst_ms']:.4g}",
                                 first["frames_with_crossings"], "", f"{float(first['max_strain']):.4g}"])
                for iterations in ITERATIONS:
                    for distance_mm in DISTANCES_MM:
                        key = scene, f"{iterations}_{distance_mm}"
                        mean_ms, worst_ms = (statistics.median(values) for values in zip(*theirs[key]))
                        row = counted[key]
                        writer.writerow([scene, f"NvCloth {nvcloth.COMMIT}", iterations, distance_mm, f"{mean_ms:.4g}", f"{worst_ms:.4g}",
                                         row["frames_with_crossings"], row["most_crossings"], f"{float(row['max_strain']):.4g}"])


def main():
    folder = pathlib.Path(sys.argv[1])
    if not folder.is_dir():
        sys.exit(f"no folder {folder}")
    measure(nvcloth.build(*nvcloth.source_of(*sys.argv[2:]), HERE / "nvcloth_contact.cpp"), folder / "contact_nvcloth.csv")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main()
