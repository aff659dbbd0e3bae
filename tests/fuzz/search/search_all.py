"""Searches every target for some CPU seconds each, and tells what was reached as a table.

The seconds are those of the processor, not of the clock, so that a search beside other work is as
long as one on a quiet machine. An input that fails ends its target's search and is kept.
"""

import argparse
import pathlib
import re
import resource
import subprocess
import sys

SLICE_S = 60  # of the clock: a longer run would measure its seconds too late


def targets_of(program):
    listing = subprocess.run([program, "--target=none"], capture_output=True, text=True)
    return re.findall(r"^  (\S+)$", listing.stderr, re.MULTILINE)


def children_cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def number(pattern, text, otherwise=0):
    found = re.findall(pattern, text)
    return int(found[-1]) if found else otherwise


def is_only_slow(program, name, stderr):
    """Whether a search ended at the time limit of an input that takes no time by itself: the machine was busy. Then the input is
    forgotten."""
    found = re.search(r"Test unit written to (\S*timeout-\S+)", stderr)
    if found is None or subprocess.run([program, name, "-timeout=10", found.group(1)], capture_output=True).returncode != 0:
        return False
    pathlib.Path(found.group(1)).unlink()
    return True


def search(program, target, cpu_s, build, corpus):
    """One row of the table: target, CPU seconds, inputs, edges reached, largest resident MB, failures."""
    found, seeds, failed = build / "found" / target, build / "seeds" / target, build / "failed"
    for folder in (found, seeds, failed):
        folder.mkdir(parents=True, exist_ok=True)
    name = f"--target={target}"
    subprocess.run([program, name, f"--write-seeds={seeds}"], check=True)
    spent_s, inputs, edges, resident_mb = 0.0, 0, 0, 0
    while spent_s < cpu_s:
        before_s = children_cpu_s()
        run = subprocess.run(
            [program, name, f"-artifact_prefix={failed}/{target}-", "-timeout=120", "-rss_limit_mb=4096",
             "-max_len=16384", "-print_final_stats=1", f"-max_total_time={SLICE_S}",
             found, seeds, corpus / target], capture_output=True, text=True, errors="replace")
        spent_s += children_cpu_s() - before_s
        inputs += number(r"number_of_executed_units:\s+(\d+)", run.stderr)
        resident_mb = max(resident_mb, number(r"peak_rss_mb:\s+(\d+)", run.stderr))
        edges = max(edges, number(r"cov: (\d+)", run.stderr))
        print(f"{target}: {spent_s:.0f} of {cpu_s} CPU s, {inputs} inputs, {edges} edges", file=sys.stderr, flush=True)
        if run.returncode != 0 and not is_only_slow(program, name, run.stderr):
            print(run.stderr[-4000:], file=sys.stderr)
            return [target, spent_s, inputs, edges, resident_mb, 1]
    return [target, spent_s, inputs, edges, resident_mb, 0]


def table(rows):
    lines = ["| target | CPU s | inputs | edges reached | largest resident MB | failed |", "|---|---|---|---|---|---|"]
    lines += [f"| {t} | {s:.0f} | {i} | {e} | {m} | {f} |" for t, s, i, e, m, f in rows]
    return "\n".join(lines) + "\n"


def rows_of(path):
    """The rows that a table has, by target."""
    rows = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 6 and cells[1].isdigit():
            rows[cells[0]] = [cells[0], *map(int, cells[1:])]
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", type=pathlib.Path, default=pathlib.Path("build/fuzz/bin/drape_fuzz"))
    parser.add_argument("--corpus", type=pathlib.Path, default=pathlib.Path("tests/fuzz/corpus"))
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build/fuzz"))
    parser.add_argument("--cpu-seconds", type=int, default=600, help="of each target")
    parser.add_argument("--out", type=pathlib.Path, help="file for the table, written after each target; without: only printed")
    parser.add_argument("--resume", action="store_true", help="keep the rows of --out that have the seconds, and do the others")
    arguments = parser.parse_args()
    done = rows_of(arguments.out) if arguments.resume and arguments.out else {}
    rows = []
    for target in targets_of(arguments.program):
        if target in done and done[target][1] >= arguments.cpu_seconds:
            rows.append(done[target])
            continue
        rows.append(search(arguments.program, target, arguments.cpu_seconds, arguments.build, arguments.corpus))
        if arguments.out:
            arguments.out.write_text(
                f"# Searches of all targets\n\nBy `./run fuzz all --seconds {arguments.cpu_seconds}`.\n\n{table(rows)}")
    print(table(rows), end="")
    sys.exit(1 if any(row[-1] for row in rows) else 0)


if __name__ == "__main__":
    main()
