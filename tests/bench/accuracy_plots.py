"""Draws the tables of `drape_bench accuracy`: run time against error per scene, orders, the parts of the error."""

import math

from matplotlib import pyplot, ticker

import accuracy_tables as tables
from rows import distinct, select

PRESET_MARKERS = {"PAPER": "X", "REALTIME": "*", "ACCURATE": "P"}
PRESET_COLOUR = "crimson"
FAMILY_COLOURS = ["tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:cyan", "tab:brown", "tab:olive", "tab:pink", "gold",
                  "navy", "lightgreen", "silver"]
PANEL_IN = (5.2, 4.0)


def panels(count, columns=3):
    columns = min(columns, count)
    lines = (count + columns - 1) // columns
    figure, axes = pyplot.subplots(lines, columns, figsize=(PANEL_IN[0] * columns, PANEL_IN[1] * lines), squeeze=False)
    for unused in axes.flat[count:]:
        unused.set_visible(False)
    return figure, list(axes.flat[:count])


def plain_log_axis(axis, low, high, write):
    """Labels as plain numbers: at 1, 2, 5 where less than two decades are shown, else at the decades."""
    axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5) if high < 100 * low else (1,), numticks=12))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: write(value)))
    axis.set_minor_formatter(ticker.NullFormatter())


def family_colours(rows):
    """The same colour for a family in every panel; presets and the peer have their own signs."""
    families = [f for f in distinct(select(rows, backend=tables.main_backend(rows)), "family") if f not in PRESET_MARKERS]
    return {family: FAMILY_COLOURS[k % len(FAMILY_COLOURS)] for k, family in enumerate(families)}


def draw_scene(panel, rows, scene, error, colours):
    label, write = tables.ERRORS[error]
    own, peer = tables.points(rows, scene, error)
    for family, colour in colours.items():
        some = sorted(select(own, family=family), key=lambda row: (row["substeps"] * row["sweeps"], row["substeps"]))
        if some:
            panel.plot([r["wall_ms_per_s"] for r in some], [r[error] for r in some], "o", color=colour, markersize=4, label=family)
    if peer:
        panel.plot([r["wall_ms_per_s"] for r in peer], [r[error] for r in peer], "^", color="black", markersize=5, label="Bullet")
    front = tables.pareto_front(own, error)
    panel.step([r["wall_ms_per_s"] for r in front], [r[error] for r in front], where="post", color="grey", linewidth=1, zorder=0)
    for preset, marker in PRESET_MARKERS.items():
        for row in select(own, method=preset):
            panel.plot(row["wall_ms_per_s"], row[error], marker, color=PRESET_COLOUR, markersize=11, markeredgecolor="white", zorder=5)
            panel.annotate(f" {preset} {write(row[error])}", (row["wall_ms_per_s"], row[error]), fontsize=7, color=PRESET_COLOUR,
                           va="bottom")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_title(f"{scene}, {select(rows, scene=scene)[0]['particles']:.0f} particles", fontsize=10)
    panel.set_xlabel("wall ms per simulated second")
    is_length = error.endswith("_m")
    panel.set_ylabel(label + (" [mm]" if is_length else " [%]"))
    xs = [r["wall_ms_per_s"] for r in own + peer]
    panel.set_xlim(min(xs) / 1.2, max(xs) * (max(xs) / min(xs)) ** 0.22 * 1.2)  # room for the labels
    plain_log_axis(panel.xaxis, min(xs), max(xs), lambda value: f"{value:g}")
    ys = [r[error] for r in own + peer]
    plain_log_axis(panel.yaxis, min(ys), max(ys), lambda value: f"{(1000 if is_length else 100) * value:g}")
    panel.grid(True, which="major", alpha=0.3)


def draw_errors(error):
    def draw(rows):
        scenes = [scene for scene in distinct(rows, "scene") if tables.points(rows, scene, error)[0]]
        figure, axes = panels(max(len(scenes), 1))
        colours = family_colours(rows)
        for panel, scene in zip(axes, scenes):
            draw_scene(panel, rows, scene, error, colours)
        by_label = {}
        for panel in axes:
            for handle, label in zip(*panel.get_legend_handles_labels()):
                by_label.setdefault(label, handle)
        if by_label:
            figure.legend(by_label.values(), by_label.keys(), loc="lower center", ncols=6, fontsize=9,
                          bbox_to_anchor=(0.5, 1.0))
        return figure
    return draw


def draw_order(rows):
    keys = list(tables.orders(rows).items())
    figure, axes = panels(1)
    for k, ((backend, method, scene), order) in enumerate(keys):
        some = select(rows, backend=backend, method=method, scene=scene)
        some = [r for r in some if math.isfinite(r["rms_position_m"])]
        axes[0].loglog([r["substep_s"] for r in some], [r["rms_position_m"] for r in some], "o-" if k < len(keys) / 2 else "s--",
                       markersize=4, label=f"{scene}: {method}, {backend}: {order:.2f}")
    axes[0].set_xlabel("substep [s]")
    axes[0].set_ylabel("RMS position error [m]")
    axes[0].grid(True, which="both", alpha=0.2)
    axes[0].legend(fontsize=8)
    figure.set_size_inches(8, 5)
    return figure


def draw_split(rows):
    cases = [(scene, method) for scene in distinct(rows, "scene") for method in distinct(select(rows, scene=scene), "method")]
    figure, axes = panels(len(cases))
    for panel, (scene, method) in zip(axes, cases):
        some = select(rows, scene=scene, method=method)
        base = select(some, sweeps=some[0]["sweeps"])
        panel.loglog([r["substeps"] for r in base], [r["discretisation_m"] for r in base], "k--", label="discretisation")
        for sweeps in distinct(some, "sweeps"):
            line = select(some, sweeps=sweeps)
            panel.loglog([r["substeps"] for r in line], [r["algebraic_m"] for r in line], "o-", markersize=4,
                         label=f"algebraic, {sweeps:.0f} sweeps")
        panel.set_title(f"{scene}: {method}", fontsize=9)
        panel.set_xlabel("substeps of a frame")
        panel.set_ylabel("RMS position error [m]")
        panel.grid(True, which="major", alpha=0.3)
        panel.legend(fontsize=7)
    return figure


DRAWINGS = {
    "accuracy_position": (draw_errors("rms_position_m"), ["accuracy"]),
    "accuracy_rms_strain": (draw_errors("rms_strain"), ["accuracy"]),
    "accuracy_max_strain": (draw_errors("max_strain"), ["accuracy"]),
    "accuracy_order": (draw_order, ["accuracy_order"]),
    "accuracy_split": (draw_split, ["accuracy_split"]),
}
