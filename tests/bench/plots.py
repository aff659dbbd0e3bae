#!/usr/bin/env python3
"""Draws the tables of drape_bench: plots.py RESULTS_DIR writes RESULTS_DIR/*.png and README.md.

Needs matplotlib (Debian: python3-matplotlib; `./run bench` installs it).
"""

import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot, ticker  # noqa: E402

import accuracy_plots  # noqa: E402
import contact_plots  # noqa: E402
import speed_plots  # noqa: E402
import stability_plots  # noqa: E402
import tables  # noqa: E402

COLOURS = {"cpu": "tab:blue", "gl": "tab:red", "reference": "tab:gray"}
SIZE_IN = (6.2, 4.6)  # of one panel


def panels(count, columns=2):
    rows = (count + columns - 1) // columns
    columns = min(columns, count)
    figure, axes = pyplot.subplots(rows, columns, figsize=(SIZE_IN[0] * columns, SIZE_IN[1] * rows), squeeze=False)
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def plain_numbers(axis, values):
    axis.set_major_locator(ticker.FixedLocator(values))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(ticker.NullLocator())


def log_log(axes, rows, column, x_label):
    axes.set_xscale("log")
    axes.set_yscale("log")
    xs = sorted({row[column] for row in rows})
    plain_numbers(axes.xaxis, xs)
    axes.set_xlim(xs[0] / 1.2, xs[-1] * (xs[-1] / xs[0]) ** 0.27 * 1.2)
    axes.tick_params(axis="x", labelsize=8, rotation=45 if len(xs) > 6 else 0)
    axes.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel(x_label)
    axes.set_ylabel("time per step [ms]")
    axes.grid(True, which="major", alpha=0.3)
    axes.axhline(tables.REAL_TIME_MS, color="black", linewidth=1, linestyle="--")
    axes.text(xs[0] / 1.15, tables.REAL_TIME_MS * 1.06, "real time: 16.7 ms", fontsize=8, va="bottom")


def curve(axes, rows, column, label, colour, style="-"):
    """Median with the range from the 10th to the 90th percentile; the label stands at the last point."""
    rows = sorted(rows, key=lambda row: row[column])
    xs = [row[column] for row in rows]
    axes.plot(xs, [row["median_ms"] for row in rows], style, color=colour, marker="o", markersize=3, linewidth=1.3)
    axes.fill_between(xs, [row["p10_ms"] for row in rows], [row["p90_ms"] for row in rows], color=colour, alpha=0.15)
    return (xs[-1], rows[-1]["median_ms"], label, colour)


def place_labels(axes, ends):
    """Labels right of the last points, pushed apart where the curves end close together."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 1.6)
    least = (high / low) ** 0.045
    y_before = 0
    for x, y, label, colour in sorted(ends, key=lambda end: end[1]):
        y_label = max(y, y_before * least)
        axes.annotate(" " + label, (x, y), (x * 1.04, y_label), color=colour, fontsize=8, va="center")
        y_before = y_label


def draw_cloths(rows):
    presets, backends = tables.distinct(rows, "preset"), tables.distinct(rows, "backend")
    figure, axes = panels(len(presets) * len(backends), columns=len(backends))
    shades = pyplot.get_cmap("viridis")
    sizes = tables.distinct(rows, "particles")
    largest, smallest = max(row["p90_ms"] for row in rows), min(row["p10_ms"] for row in rows)
    for panel, (preset, backend) in zip(axes, [(p, b) for p in presets for b in backends]):
        log_log(panel, rows, "cloths", "cloths")
        panel.set_ylim(smallest / 1.3, largest * 1.5)
        ends = []
        for k, size in enumerate(sizes):
            some = tables.select(rows, preset=preset, backend=backend, particles=size)
            if some:
                ends.append(curve(panel, some, "cloths", f"{size:.0f} particles", shades(0.9 * k / max(len(sizes) - 1, 1))))
        place_labels(panel, ends)
        panel.set_title(f"{backend}, {preset}")
    return figure


def draw_particles(rows):
    presets = tables.distinct(rows, "preset")
    figure, axes = panels(len(presets))
    for panel, preset in zip(axes, presets):
        log_log(panel, rows, "particles", "particles of the one cloth")
        ends = []
        for backend in tables.distinct(rows, "backend"):
            for pins, style in zip(tables.distinct(rows, "pins"), ("-", ":")):
                some = tables.select(rows, preset=preset, backend=backend, pins=pins)
                if some:
                    ends.append(curve(panel, some, "particles", f"{backend}, {pins}", COLOURS.get(backend), style))
        place_labels(panel, ends)
        panel.set_title(f"{preset} (pinned: two corners, or one edge)")
    return figure


def draw_figure_4(motion, _):
    figure, axes = panels(2)
    presets = tables.distinct(motion, "preset")
    for preset, colour in zip(presets, ("tab:blue", "tab:orange", "tab:green")):
        rows = tables.select(motion, preset=preset)
        times = [row["time_s"] for row in rows]
        axes[0].plot(times, [row["contacts"] for row in rows], color=colour)
        axes[0].annotate(" " + preset, (times[-1], rows[-1]["contacts"]), color=colour, fontsize=8, va="center")
        for column, style in (("max_strain", ":"), ("rms_strain", "-")):
            values = [100 * row[column] for row in rows]
            axes[1].plot(times, values, style, color=colour)
            axes[1].annotate(f" {preset}, {column[:3]}", (times[-1], values[-1]), color=colour, fontsize=8, va="center")
    axes[0].set_ylabel("particles touching the sphere")
    axes[0].axhline(2000, color="black", linewidth=1, linestyle="--")
    axes[0].text(0, 2000, "2000", fontsize=8, va="bottom")
    axes[1].set_ylabel("strain of the distance constraints [%]")
    axes[1].set_yscale("log")
    axes[1].yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    for panel in axes:
        panel.set_xlabel("time [s]")
        panel.set_xlim(0, max(row["time_s"] for row in motion) * 1.25)
        panel.grid(True, alpha=0.3)
    return figure


def draw_order(rows):
    sweeps, errors, _ = tables.order_ratios(rows)
    scenes = tables.distinct(rows, "scene")
    names = list(tables.ORDER_NAMES)
    figure, axes = panels(2)
    for panel, values, title in ((axes[0], sweeps, "sweeps to tolerance 1e-3"), (axes[1], errors, "RMS error after 100 sweeps")):
        for k, scene in enumerate(scenes):
            for n, name in enumerate(names):
                y = -(k * (len(names) + 1) + n)
                points = values[(scene, name)]
                panel.plot(points, [y] * len(points), "|", color=f"C{n}", markersize=9)
        panel.axvline(1, color="black", linewidth=1)
        panel.axvspan(0.8, 1.2, color="black", alpha=0.06)
        panel.set_xscale("log")
        plain_numbers(panel.xaxis, [0.3, 0.5, 0.65, 0.8, 1, 1.2, 1.5, 2, 4, 8])
        panel.set_xlabel(title + ", relative to Algorithm 1's order (grey: ± 20 %)")
        panel.set_yticks([-(k * (len(names) + 1) + n) for k in range(len(scenes)) for n in range(len(names))],
                         [f"{scene}: {name}" for scene in scenes for name in names], fontsize=8)
    figure.set_size_inches(14, 1 + 0.28 * len(scenes) * (len(names) + 1))
    return figure


# Tables that must have rows, then those that a drawing can do without (None).
DRAWINGS = {
    "cloths": (draw_cloths, ["cloths"]),
    "particles": (draw_particles, ["particles"]),
    "figure_4": (draw_figure_4, ["figure_4_motion", "figure_4"]),
    "order": (draw_order, ["order"]),
    **accuracy_plots.DRAWINGS,
    **speed_plots.DRAWINGS,
    **contact_plots.DRAWINGS,
}


def save(figure, path):
    figure.savefig(path, dpi=110, bbox_inches="tight")
    pyplot.close(figure)
    print(path)


def main():
    parser = argparse.ArgumentParser(description="Draws the tables of a results folder and writes its README.md.")
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder
    for name, (draw, sources, *optional) in DRAWINGS.items():
        rows = [tables.read_table(folder, source) for source in sources]
        if not all(rows):
            print(f"{name}: no rows in {folder}, not drawn")
            continue
        figure = draw(*rows, *(tables.read_table(folder, source) for source in sum(optional, [])))
        figure.tight_layout()
        save(figure, folder / (name + ".png"))
    for name, figure in stability_plots.figures(tables.read_table(folder, "stability") or []):
        save(figure, folder / (name + ".png"))
    (folder / "README.md").write_text(tables.readme(folder), encoding="utf-8")
    print(folder / "README.md")


if __name__ == "__main__":
    main()
