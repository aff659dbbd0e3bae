"""The table of the costs in words: ms per step against cloths and particles, and whether the bars hold."""

import math
from statistics import median

from rows import distinct, markdown, milliseconds, select

COLUMNS = [
    "along", "preset", "cloths", "particles", "constraints", "backend", "path", "threads", "steps", "median_ms", "p10_ms", "p90_ms",
    "min_ms", "dispatches", "iterations", "faulted"]
FLATNESS_COLUMNS = ["along", "backend", "cloths", "particles", "round", "ms"]
FLAT_CLOTHS, FLAT_CLOTHS_BAR = (64, 4096), 1.15
FLAT_PARTICLES, FLAT_PARTICLES_BAR = (1024, 65536), 2
THREADS_BAR = 0.9  # of the number of threads: two threads 1.8 times as fast as one
BIG_CLOTH = 65536  # particles


def us_per_cloth(row):
    return 1000 * row["median_ms"] / row["cloths"]


def ns_per_particle(row):
    return 1e6 * row["median_ms"] / row["cloths"] / row["particles"]


def way(row):
    threads = f", {row['threads']:.0f} thread{'s' if row['threads'] > 1 else ''}" if row["threads"] else ""
    return f"{row['backend']} {row['path']}{threads}"


def ways_of_one_cloth(rows):
    """Names of the ways of the rows along the particles, and the rows of each. The path of gl depends on the size."""
    found = {}
    for row in rows:
        threads = f", {row['threads']:.0f} thread{'s' if row['threads'] > 1 else ''}" if row["threads"] else ""
        found.setdefault(row["backend"] + threads, []).append(row)
    return found


def most_threads(rows):
    return max(row["threads"] for row in rows)


def within(rows, column, limits):
    return [row for row in rows if limits[0] <= row[column] <= limits[1]]


def flatness_line(rows, along, limits, unit, bar):
    """Ratio of the costs of the sizes: largest over least of the medians of the rounds, in which the sizes took turns."""
    some = within(select(rows, along=along), along, limits)
    costs = {}
    for row in some:
        costs.setdefault(row[along], []).append(1e3 * row["ms"] / (row["cloths"] if along == "cloths" else row["particles"]))
    if not set(limits) <= set(costs):
        return []
    medians = {size: median(found) for size, found in costs.items()}
    low, high = min(medians, key=medians.get), max(medians, key=medians.get)
    ratio = medians[high] / medians[low]
    words = f"{ratio:.2f} ({medians[low]:.3g} {unit} at {low:.0f}, {medians[high]:.3g} at {high:.0f})"
    return [[f"{some[0]['backend']}, all threads", f"{limits[0]} … {limits[1]} {along}", words, f"≤ {bar:g}", "yes" if ratio <= bar else "NO"]]


def threads_line(name, rows, column, at_most):
    """One thread against all at the largest size that both have; `rows` of one way of stepping but for the threads."""
    most = most_threads(rows) if rows else 1
    of_one = {row[column]: row for row in select(rows, threads=1)}
    both = [row for row in select(rows, threads=most) if row[column] in of_one and row[column] <= at_most]
    if most < 2 or not both:
        return []
    row = max(both, key=lambda row: row[column])
    ratio = of_one[row[column]]["median_ms"] / row["median_ms"]
    return [[name, f"{most:.0f} threads against one, {row[column]:.0f} {column}", f"{ratio:.2f}", f"≥ {THREADS_BAR * most:.3g}",
             "yes" if ratio >= THREADS_BAR * most else "NO"]]


def bars_text(rows, flatness):
    cloths = select(rows, along="cloths", preset="REALTIME")
    particles = select(rows, along="particles")
    lines = flatness_line(flatness, "cloths", FLAT_CLOTHS, "µs per cloth", FLAT_CLOTHS_BAR)
    lines += flatness_line(flatness, "particles", FLAT_PARTICLES, "µs per particle of one cloth", FLAT_PARTICLES_BAR)
    lines += threads_line("cpu lanes", select(cloths, path="lanes"), "cloths", math.inf)
    lines += threads_line("cpu, one cloth", select(particles, backend="cpu"), "particles", BIG_CLOTH)
    return ["#### Bars\n", "Flatness: sizes in turn, round after round, the medians of the rounds (speed_flatness.csv).\n", markdown(["what", "between", "largest / least", "bar", "holds"], lines)]


def cloths_text(rows, preset):
    of_preset = select(rows, along="cloths", preset=preset)
    ways = list(dict.fromkeys(way(row) for row in of_preset))
    lines = []
    for count in distinct(of_preset, "cloths"):
        found = {way(row): row for row in select(of_preset, cloths=count)}
        cells = [f"{milliseconds(found[name]['median_ms'])} / {us_per_cloth(found[name]):.0f}" if name in found else "" for name in ways]
        most = most_threads(of_preset)
        pair = {row["path"]: row["median_ms"] for row in found.values() if row["threads"] == most}
        ratio = f"{pair['single'] / pair['lanes']:.2f}" if {"single", "lanes"} <= set(pair) else ""
        lines.append([f"{count:.0f}", *cells, ratio])
    return [f"{preset}, ms per step / µs per cloth:\n", markdown(["cloths", *ways, "single / lanes"], lines)]


def cost_text(rows, flatness, cpu_backend):
    text = ["### What a step costs\n",
            f"Sheets hung by two corners, in the middle of the swing; each of several cloths has its own gravity. cpu: {cpu_backend}. "
            "`lanes`: side by side in the lanes of the vector registers wherever that pays; `single`: one by one, with the same "
            "bits. A row omits ways of stepping that would take too long.\n",
            "![cost](speed_cost.png)\n", *bars_text(rows, flatness)]
    for preset in distinct(select(rows, along="cloths"), "preset"):
        text += cloths_text(rows, preset)
    particles = select(rows, along="particles")
    ways = ways_of_one_cloth(particles)
    lines = []
    for count in distinct(particles, "particles"):
        found = {name: row for name, of_way in ways.items() for row in select(of_way, particles=count)}
        lines.append([f"{count:.0f}", *(f"{milliseconds(found[w]['median_ms'])} / {ns_per_particle(found[w]):.0f} ({found[w]['path']})"
                                        if w in found else "" for w in ways)])
    if lines:
        text += ["One cloth, REALTIME, ms per step / ns per particle:\n", markdown(["particles", *ways], lines)]
    return text
