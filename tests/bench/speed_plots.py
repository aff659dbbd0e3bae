"""Draws the tables of `drape_bench speed`."""

import math

from matplotlib import pyplot, ticker
from matplotlib.colors import ListedColormap

import speed_cost
import speed_curve
import speed_nvcloth
from rows import distinct, select

SIZE_IN = (6.6, 5)
FAMILY_COLOURS = ListedColormap((*pyplot.get_cmap("tab10").colors, *pyplot.get_cmap("Dark2").colors[3:8:4], "navy"))


def plain(axis):
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))


def nvcloth_points(measured, has_tethers):
    """us, max strain, RMS strain; and whether they were measured here."""
    if measured:
        some = [row for row in measured if row["cloths"] > 1 and row["has_tethers"] == has_tethers]
        return [(row["us_one_thread"], row["max_strain"], row["rms_strain"]) for row in some], ""
    return [point for point in speed_nvcloth.POINTS if point[3] == has_tethers], " (one sheet, not measured here)"


def draw_curve(rows, nvcloth):
    """Time per cloth and frame on one thread against max and RMS strain."""
    figure, axes = pyplot.subplots(1, 2, figsize=(2 * SIZE_IN[0], 1.3 * SIZE_IN[1]))
    ok = [row for row in rows if row["status"] == "ok" and math.isfinite(row["us_one_thread"])]
    families = distinct(ok, "family")
    for panel, column, coordinate in ((axes[0], "max_strain", 1), (axes[1], "rms_strain", 2)):
        for k, family in enumerate(families):
            some = sorted(select(ok, family=family), key=lambda row: row["us_one_thread"])
            panel.plot([row["us_one_thread"] for row in some], [100 * row[column] for row in some], marker="o", markersize=3.5,
                       linewidth=1.1, linestyle="--" if family == "Bullet" else "-", color=FAMILY_COLOURS(k % FAMILY_COLOURS.N), label=family)
        for has_tethers, marker in ((False, "s"), (True, "D")):
            points, source = nvcloth_points(nvcloth, has_tethers)
            panel.plot([point[0] for point in points], [100 * point[coordinate] for point in points], marker, color="black",
                       fillstyle="none", label="NvCloth" + (", tethers" if has_tethers else "") + source)
        panel.set_xscale("log")
        panel.set_yscale("log")
        plain(panel.xaxis)
        plain(panel.yaxis)
        panel.set_xlabel("one thread: time per cloth and frame of 1/60 s [µs]")
        panel.set_ylabel(f"{column.split('_')[0]} strain in the last second [%]")
        panel.grid(True, which="both", alpha=0.25)
    axes[0].axhline(100 * speed_curve.STRAIN_BAR, color="black", linewidth=1, linestyle=":")
    figure.legend(*axes[1].get_legend_handles_labels(), fontsize=8, ncol=5, loc="upper center", bbox_to_anchor=(0.5, 0.02))
    return figure


def curve_of(panel, rows, column, cost, label):
    rows = sorted(rows, key=lambda row: row[column])
    panel.plot([row[column] for row in rows], [cost(row) for row in rows], marker="o", markersize=3.5, linewidth=1.2, label=label)


def draw_cost(rows):
    figure, axes = pyplot.subplots(1, 2, figsize=(2 * SIZE_IN[0], SIZE_IN[1]))
    cloths = select(rows, along="cloths", preset="REALTIME")
    for name in dict.fromkeys(speed_cost.way(row) for row in cloths):
        curve_of(axes[0], [row for row in cloths if speed_cost.way(row) == name], "cloths", speed_cost.us_per_cloth, name)
    for name, of_way in speed_cost.ways_of_one_cloth(select(rows, along="particles")).items():
        curve_of(axes[1], of_way, "particles", speed_cost.ns_per_particle, name)
    for panel, x_label, y_label in ((axes[0], "cloths", "time per cloth and step [µs]"),
                                    (axes[1], "particles of the one cloth", "time per particle and step [ns]")):
        panel.set_xscale("log")
        panel.set_yscale("log")
        plain(panel.xaxis)
        plain(panel.yaxis)
        panel.set_xlabel(x_label)
        panel.set_ylabel(y_label)
        panel.grid(True, which="both", alpha=0.25)
        if panel.lines:
            panel.legend(fontsize=8)
    return figure


DRAWINGS = {"speed_curve": (draw_curve, ["speed_curve"], ["speed_nvcloth"]), "speed_cost": (draw_cost, ["speed_cost"])}
