#!/usr/bin/env python3
"""Reads the tables of drape_bench and writes the README.md of a results folder.

Usage: tables.py RESULTS_DIR            writes RESULTS_DIR/README.md
       tables.py --check RESULTS_DIR    reads everything and prints rows per table, writes nothing

Only the standard library: plots.py draws the same rows with matplotlib.
"""

import argparse
import collections
import json
import pathlib
import statistics
import sys

import accuracy_bars
import accuracy_quantities
import accuracy_tables
import contact_tables
import rows
import speed_tables
import stability_tables
from rows import distinct, markdown, milliseconds, percent, select

REAL_TIME_MS = 1000 / 60
TEXT_COLUMNS = {"preset", "pins", "backend", "plan", "scene", "shuffled", "fault", "path", "way"} | accuracy_tables.TEXT_COLUMNS | accuracy_quantities.TEXT_COLUMNS | speed_tables.TEXT_COLUMNS | stability_tables.TEXT_COLUMNS | contact_tables.TEXT_COLUMNS
STEP_COLUMNS = [
    "preset", "pins", "cloths", "particles", "columns", "rows", "backend", "plan", "steps", "median_ms", "p10_ms",
    "p90_ms", "min_ms", "max_ms", "device_ms", "dispatches", "iterations", "max_strain", "swing_max_strain",
    "contacts", "solves_per_s", "faulted"]
COLUMNS = {
    "cloths": STEP_COLUMNS,
    "particles": STEP_COLUMNS,
    "figure_4": STEP_COLUMNS,
    "figure_4_motion": [
        "preset", "particles", "backend", "time_s", "contacts", "max_strain", "rms_strain", "kinetic_energy_j",
        "lowest_m", "max_penetration_m", "iterations", "fault"],
    "order": [
        "scene", "particles", "constraints", "time_s", "substep_s", "shuffled", "seed", "colours", "sweeps",
        "max_error_after_100", "rms_error_after_100"],
    "budget": [
        "backend", "particles", "budget_ms", "steps", "median_ms", "p90_ms", "p99_ms", "max_ms", "sweep_ms", "cap_median",
        "cap_min", "over_budget"],
    "bodies": ["scene", "bodies", "joints", "backend", "steps", "median_ms", "p90_ms", "max_ms"],
    "pictures": ["scene", "way", "pictures", "width_px", "height_px", "rounds", "p10_ms", "median_ms", "p90_ms", "cpu_ms"],
    **speed_tables.COLUMNS,
    **accuracy_tables.COLUMNS,
    **accuracy_quantities.COLUMNS,
    **stability_tables.COLUMNS,
    **contact_tables.COLUMNS,
}
MOST_SWEEPS = 3000  # kMaxSweeps in order.cpp: as many mean "not converged"


def read_table(folder, name):
    return rows.read_table(folder, name, COLUMNS[name], TEXT_COLUMNS)


def read_machine(folder):
    with open(pathlib.Path(folder) / "machine.json", encoding="utf-8") as file:
        return json.load(file)


def pivot(rows, column, backends):
    """One line per value of `column`, one median per backend; bold: faster than real time."""
    lines = []
    for value in distinct(rows, column):
        cells = []
        for backend in backends:
            found = select(rows, **{column: value, "backend": backend})
            median = found[0]["median_ms"] if found else None
            text = "" if median is None else milliseconds(median)
            cells.append(f"**{text}**" if median is not None and median <= REAL_TIME_MS else text)
        lines.append([f"{value:.0f}", *cells])
    return markdown([column, *(f"{backend} [ms]" for backend in backends)], lines)


def largest_in_real_time(rows, column):
    """Largest value of a column whose step takes no longer than it simulates; None if there is none."""
    values = [row[column] for row in rows if row["median_ms"] <= REAL_TIME_MS and row["faulted"] == 0]
    return max(values, default=None)


def cloths_text(rows):
    text = ["## Cloths (figure 3c of the paper)\n",
            "ms per step against the number of independent cloths. Bold: real time, a step of 1/60 s within 16.7 ms.\n",
            "![cloths](cloths.png)\n"]
    backends = distinct(rows, "backend")
    most = max(distinct(rows, "particles"))
    for preset in distinct(rows, "preset"):
        text.append(f"\nCloths of {most:.0f} particles, {preset}:\n")
        text.append(pivot(select(rows, preset=preset, particles=most), "cloths", backends))
        real_time = [f"`{b}` {largest_in_real_time(select(rows, preset=preset, particles=most, backend=b), 'cloths') or 0:.0f}"
                     for b in backends]
        text.append("Most cloths measured in real time: " + ", ".join(real_time) +
                    ". The paper (GeForce 9800 GTX): 16.\n")
    return text


def particles_text(rows):
    text = ["## Particles (figure 3b of the paper)\n",
            "ms per step of one cloth against its particles.\n", "![particles](particles.png)\n"]
    for preset in distinct(rows, "preset"):
        for pins in distinct(rows, "pins"):
            some = select(rows, preset=preset, pins=pins)
            if some:
                text.append(f"\n{preset}, pins: {pins}:\n")
                text.append(pivot(some, "particles", distinct(rows, "backend")))
    text.append("\nLargest strain of any constraint in the first half second, and sweeps in a step:\n")
    lines = []
    cases = [(preset, pins) for preset in distinct(rows, "preset") for pins in distinct(rows, "pins")]
    backend = distinct(rows, "backend")[0]
    for count in distinct(rows, "particles"):
        line = [f"{count:.0f}"]
        for preset, pins in cases:
            found = select(rows, preset=preset, pins=pins, particles=count, backend=backend)
            line.append(f"{percent(found[0]['swing_max_strain'])} / {found[0]['iterations']:.0f}" if found else "")
        lines.append(line)
    text.append(markdown(["particles", *(f"{preset}, {pins}" for preset, pins in cases)], lines))
    text.append("The paper, PAPER settings (at most 100 sweeps), pins not stated: 1024 particles below 1 % with fewer than 100 "
                "sweeps, 16 384 particles 8 % at 100 sweeps.\n")
    return text


def figure_4_text(motion, rows):
    text = ["## Figure 4 of the paper\n",
            "256×256 particles, 2 m, two corners pinned, released horizontally, swing onto a sphere with friction. Each backend is "
            "timed from the state with the most contacts.\n", "![figure 4](figure_4.png)\n"]
    lines = []
    for preset in distinct(motion, "preset"):
        some = select(motion, preset=preset)
        touching = [row for row in some if row["contacts"] > 0]
        lines.append([preset, some[0]["backend"], f"{max(r['contacts'] for r in some):.0f}",
                      f"{statistics.median(r['contacts'] for r in touching) if touching else 0:.0f}",
                      percent(max(r["max_strain"] for r in some)), percent(max(r["rms_strain"] for r in some))])
    text.append(markdown(["preset", "played on", "most contacts", "median contacts while touching", "max strain",
                          "largest RMS strain"], lines))
    for preset in distinct(rows, "preset"):
        text.append(f"\n{preset}, ms per step:\n")
        text.append(pivot(select(rows, preset=preset), "particles", distinct(rows, "backend")))
    return text


def order_ratios(rows):
    """(scene, shuffled) -> ratios to Algorithm 1 of sweeps to tolerance (where Algorithm 1 gets there) and of
    RMS error after 100 sweeps, over moments, substeps and seeds; and the numbers of colours."""
    base = {(r["scene"], r["time_s"], r["substep_s"]): r for r in select(rows, shuffled="nothing")}
    sweeps, errors, colours = (collections.defaultdict(list) for _ in range(3))
    for row in rows:
        key = (row["scene"], row["shuffled"])
        reference = base[(row["scene"], row["time_s"], row["substep_s"])]
        colours[key].append(row["colours"])
        errors[key].append(row["rms_error_after_100"] / reference["rms_error_after_100"])
        if reference["sweeps"] < MOST_SWEEPS:
            sweeps[key].append(row["sweeps"] / reference["sweeps"])
    return sweeps, errors, colours


def spread(values):
    if not values:
        return "not converged"
    return f"{statistics.median(values):.2f} ({min(values):.2f} … {max(values):.2f})"


ORDER_NAMES = {
    "colours": "the colours of Algorithm 1 in random order",
    "input": "Algorithm 1 on a shuffled list",
    "all": "no colours, random order",
    "from_pins": "no colours, from the pins outwards",
    "towards_pins": "no colours, towards the pins",
}


def order_text(rows):
    sweeps, errors, colours = order_ratios(rows)
    seeds = len(distinct(select(rows, shuffled="colours"), "seed"))
    text = ["## Order of the groups (section 3.3 of the paper)\n",
            "«The influence on the convergence rate is even insignificant.» Values are relative to Algorithm 1's own order: sweeps to "
            f"the tolerance of PAPER (1e-3; where Algorithm 1 needs fewer than {MOST_SWEEPS}), and RMS error after 100 sweeps; "
            f"median (smallest … largest) over {seeds} seeds, moments and substeps.\n", "![order](order.png)\n"]
    lines = []
    for scene in distinct(rows, "scene"):
        for name, meaning in ORDER_NAMES.items():
            key = (scene, name)
            counts = sorted({int(c) for c in colours[key]})
            count = "–" if counts == [0] else f"{counts[0]}" if len(counts) == 1 else f"{counts[0]}–{counts[-1]}"
            lines.append([f"{scene}: {meaning}", count, spread(sweeps[key]), spread(errors[key])])
        own = sorted({int(c) for c in colours[(scene, "nothing")]})
        lines[-len(ORDER_NAMES)][1] += f" (Algorithm 1: {own[0]})"
    text.append(markdown(["scene: order", "colours", "sweeps", "RMS error"], lines))
    text.append("\nIs the statement true for the order of the colours? (Insignificant: every case within 20 %.)\n")
    for scene in distinct(rows, "scene"):
        values = sweeps[(scene, "colours")] + errors[(scene, "colours")]
        holds = all(0.8 <= value <= 1.2 for value in values)
        text.append(f"- {scene}: {'confirmed' if holds else 'refuted'}; between {min(values):.2f} and {max(values):.2f} times "
                    "Algorithm 1's.")
    return [*text, ""]


def bodies_text(rows):
    lines = [[row["scene"], row["backend"], *(f"{row[key]:.0f}" for key in ("bodies", "joints")),
              *(f"{row[key]:.3g}" for key in ("median_ms", "p90_ms", "max_ms"))] for row in rows]
    return ["## Bodies\n",
            f"Each scene from its start, {rows[0]['steps']:.0f} steps of 1/60 s, REALTIME; a backend has one thread for a scene.\n",
            markdown(["scene", "backend", "bodies", "joints", "median [ms]", "90 % [ms]", "most [ms]"], lines)]


def pictures_text(rows):
    lines = [[row["scene"], row["way"], f"{row['pictures']:.0f}", f"{row['width_px']:.0f}×{row['height_px']:.0f}",
              *(f"{row[key]:.1f}" for key in ("p10_ms", "median_ms", "p90_ms", "cpu_ms"))] for row in rows]
    return ["## Pictures\n",
            "The renderer without requests: tiles in one call beside the same pictures one by one, cheaper ones and parts left "
            "out (all with depths), then large ones; in turn, in one run.\n",
            markdown(["scene", "way", "pictures", "pixels", "10 % [ms]", "median [ms]", "90 % [ms]", "processor [ms]"], lines)]


def budget_text(rows):
    lines = [[f"{row['backend']}, {row['budget_ms']:g} ms", *(f"{row[key]:.3g}" for key in (
        "sweep_ms", "median_ms", "p90_ms", "p99_ms", "max_ms", "cap_median", "cap_min", "over_budget")),
        "yes" if row["p99_ms"] <= row["budget_ms"] + row["sweep_ms"] else "NO"] for row in rows]
    return ["## Frame budget (section 3.5 of the paper)\n",
            f"A swinging sheet of {rows[0]['particles']:.0f} particles, PAPER without tolerance, so a step does every sweep that the budget allows. "
            "Times of a step, which may exceed the budget by one sweep.\n",
            markdown(["budget", "one sweep [ms]", "median [ms]", "90 % [ms]", "99 % [ms]", "most [ms]", "sweeps, median", "least",
                      "steps over budget", "99 % ≤ budget + sweep"], lines)]


def accuracy_text(read):
    """Everything that the tables of accuracy say; parts that were not measured are left out."""
    table, order, energy, creep = (read["accuracy"], read["accuracy_order"], read["accuracy_energy"], read["accuracy_creep"])
    text = ["## Accuracy: run time against error\n",
            "What is measured and how: tests/bench/notes/method.md. Wall ms per simulated second, median of the repeats, the methods in "
            "turn in one run.\n"]
    text += accuracy_bars.bars_text(table, order, energy, creep)
    text += ["![position error](accuracy_position.png)\n", "![RMS strain](accuracy_rms_strain.png)\n",
             "![max strain](accuracy_max_strain.png)\n"]
    text += accuracy_tables.losses_text(table) + accuracy_tables.scenes_text(table)
    text += accuracy_tables.contacts_text(table) + accuracy_tables.parity_text(table)
    if order:
        text += accuracy_tables.order_text(order)
    if energy and creep:
        text += accuracy_tables.energy_text(energy, creep)
    if read["accuracy_split"]:
        text += accuracy_tables.split_text(read["accuracy_split"])
    if read["accuracy_references"]:
        text += accuracy_tables.references_text(read["accuracy_references"])
    return text


def readme(folder):
    machine = read_machine(folder)
    text = [f"# {machine['machine']}\n",
            "Written by `tests/bench/tables.py` from the CSV files beside it; do not edit.\n",
            f"- processor: {machine['cpu']}, {machine['cores']} cores, {', '.join(machine['instruction_sets'])}",
            f"- GL: {machine['gl'] or 'not measured'}",
            f"- built with {machine['compiler']}, {machine['flags']}; Drape {machine['drape_version']}", ""]
    notes = machine["tables"]
    for command in dict.fromkeys(note["command"] for note in notes.values()):
        names = [name for name, note in notes.items() if note["command"] == command]
        note = notes[names[0]]
        text.append(f"`{command}` ({note['date']}{', commit ' + note['commit'] if note['commit'] else ''}) made {', '.join(names)}.\n")
    tables = {name: read_table(folder, name) for name in COLUMNS}
    if tables["cloths"]:
        text += cloths_text(tables["cloths"])
    if tables["particles"]:
        text += particles_text(tables["particles"])
    if tables["figure_4"] and tables["figure_4_motion"]:
        text += figure_4_text(tables["figure_4_motion"], tables["figure_4"])
    if tables["order"]:
        text += order_text(tables["order"])
    if tables["budget"]:
        text += budget_text(tables["budget"])
    if tables["bodies"]:
        text += bodies_text(tables["bodies"])
    if tables["pictures"]:
        text += pictures_text(tables["pictures"])
    text += speed_tables.speed_text(tables, machine["cpu_backend"], machine["gl"])
    if tables["accuracy"]:
        text += accuracy_text(tables)
    if tables["accuracy_quantities"]:
        text += accuracy_quantities.quantities_text(tables["accuracy_quantities"])
    if tables["contact"]:
        text += contact_tables.contact_text(tables["contact"], tables["contact_frames"], tables["contact_nvcloth"])
    if tables["stability"]:
        text += stability_tables.stability_text(tables["stability"])
    if tables["stability_random"]:
        text += stability_tables.random_text(tables["stability_random"])
    return rows.wrapped("\n".join(text))


def main():
    parser = argparse.ArgumentParser(description="Writes README.md of a results folder from its tables.")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--check", action="store_true", help="only read, print the rows of each table")
    options = parser.parse_args()
    try:
        if options.check:
            readme(options.folder)
            for name in COLUMNS:
                found = read_table(options.folder, name)
                print(name, "-" if found is None else len(found))
            return
        (options.folder / "README.md").write_text(readme(options.folder), encoding="utf-8")
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"tables.py: {type(error).__name__}: {error}")


if __name__ == "__main__":
    main()
