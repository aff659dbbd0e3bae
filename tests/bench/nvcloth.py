#!/usr/bin/env python3
"""The hanging sheets of `./run bench speed` with NvCloth: nvcloth.py RESULTS_DIR [CHECKOUT] writes RESULTS_DIR/speed_nvcloth.csv.

The same 64 sheets (nvcloth_sheets.cpp), one thread: µs per cloth and frame (mean over the frames, median of three plays), max and RMS of
|l − l0| / l0 over the edges along rows and columns in the last second; then one sheet alone under gravity straight down. CHECKOUT: a git
checkout of NvCloth at the commit below, otherwise git gets one; the program is built in out/nvcloth. About four minutes. Not part of ./run bench:
afterwards plots.py RESULTS_DIR shows the rows.
"""

import concurrent.futures
import csv
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

URL, COMMIT = "https://github.com/NVIDIAGameWorks/NvCloth", "6e86b18"
COLUMNS = ["program", "build", "has_tethers", "iterations", "cloths", "us_one_thread", "max_strain", "rms_strain"]
CLOTHS, SECONDS, ROUNDS = 64, 4, 3
# t: with tethers; iterations per frame.
ROWS = ["t3", "t5", "t8", "t10", "t20", "t50", "n10", "n20", "n30", "n50", "n100"]
# The library as its own build scripts define it, but with GCC and for this processor: the intrinsics of its Linux build are those of SSE2,
# which GCC then encodes for AVX.
FLAGS = ["-O2", "-march=native", "-fstrict-aliasing", "-DNDEBUG", "-DNV_CLOTH_IMPORT=", "-DNV_CLOTH_ENABLE_DX11=0", "-DNV_CLOTH_ENABLE_CUDA=0"]
LIBRARY_FLAGS = ["-std=c++11", "-fno-rtti", "-fno-exceptions", "-w", "-fpermissive"]
HERE = pathlib.Path(__file__).resolve()


def checkout(folder):
    if not folder.exists():
        with tempfile.TemporaryDirectory(dir=folder.parent) as part:  # whole or not at all
            clone = pathlib.Path(part) / "clone"
            subprocess.run(["git", "clone", "--quiet", URL, clone], check=True)
            subprocess.run(["git", "-C", clone, "checkout", "--quiet", COMMIT], check=True)
            clone.rename(folder)
    return folder


def commit_of(folder):
    """None where the folder is not the top of a git checkout."""
    if not (folder / ".git").exists():
        return None
    return subprocess.run(["git", "-C", folder, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()


def build(source, folder, main, flags=()):
    """The program whose main file is `main`, with the library; all compiled with these flags, too."""
    library = source / "NvCloth"
    files = [*sorted((library / "src").glob("*.cpp")), library / "src/ps/unix/PsUnixAtomic.cpp", *sorted((library / "extensions/src").glob("*.cpp"))]
    includes = [f"-I{path}" for path in (library / "include", library / "extensions/include", library / "src", library / "extensions/src",
                                         source / "PxShared/include")]
    jobs = [(file, LIBRARY_FLAGS) for file in files] + [(main, ["-std=c++20", "-w"])]
    folder.mkdir(parents=True, exist_ok=True)

    def compile_one(job):
        file, its_flags = job
        subprocess.run(["g++", *FLAGS, *flags, *its_flags, *includes, "-c", file, "-o", folder / (file.stem + ".o")], check=True)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(compile_one, jobs))
    program = folder / main.stem
    subprocess.run(["g++", *(folder / (file.stem + ".o") for file, _ in jobs), "-o", program], check=True)
    return program


def play(program, cloths):
    """The rows of one play: (has_tethers, iterations) -> (us, max strain, RMS strain)."""
    out = subprocess.run([program, str(cloths), str(SECONDS), *ROWS], check=True, capture_output=True, text=True).stdout
    words = [line.split() for line in out.splitlines()]
    return {(int(row[0]), int(row[1])): [float(word) for word in row[3:]] for row in words}


def measure(program, path):
    version = subprocess.run(["g++", "-dumpfullversion"], check=True, capture_output=True, text=True).stdout.strip()
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for cloths in (CLOTHS, 1):
            plays = []
            for number in range(ROUNDS):
                print(f"{cloths} cloths: play {number + 1} of {ROUNDS}", flush=True)
                plays.append(play(program, cloths))
            for row, (_, largest, rms) in plays[0].items():
                us = statistics.median(one[row][0] for one in plays)
                values = [f"NvCloth {COMMIT}", f"GCC {version} {FLAGS[0]} {FLAGS[1]}", *row, cloths, *(f"{value:.6g}" for value in (us, largest, rms))]
                writer.writerow(values)
                print(*values, flush=True)


def program_of(main, given, flags=()):
    """The program made of `main` and the library, of the checkout in the folder `given`, else of one that git makes."""
    out = HERE.parents[2] / "out" / "nvcloth"
    out.mkdir(parents=True, exist_ok=True)
    source = pathlib.Path(given).resolve() if given else checkout(out / "source")
    commit = commit_of(source)
    if not (commit or "").startswith(COMMIT):
        sys.exit(f"{source} is at {commit or 'no commit of git'}: it must be a checkout of {URL} at {COMMIT}")
    return build(source, out / ("build_" + main.stem), main, flags)


def main():
    folder = pathlib.Path(sys.argv[1])
    if not folder.is_dir():
        sys.exit(f"no folder {folder}: RESULTS_DIR is where ./run bench speed wrote its tables")
    program = program_of(HERE.parent / "nvcloth_sheets.cpp", sys.argv[2] if len(sys.argv) == 3 else None)
    measure(program, folder / "speed_nvcloth.csv")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main()
