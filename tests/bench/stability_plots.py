"""Draws the tables of `drape_bench stability`: a map per method, coloured by verdict."""

from matplotlib import patches, pyplot

import stability_tables as tables
from rows import distinct, select

COLOURS = {"survives": "#8fd18f", "recovers": "#dcefa0", "warns": "#ffc562", "breaks": "#f2807a", "faults": "#b79be0"}
CELL_IN = (0.86, 0.34)


def draw_map(panel, rows, row_names, column_names):
    for row in rows:
        x, y = column_names.index(row["column"]), row_names.index(row["row"])
        is_in_bar = row["in_bar"] == 1
        panel.add_patch(patches.Rectangle((x, y), 1, 1, facecolor=COLOURS[row["verdict"]], edgecolor="white", linewidth=1))
        if is_in_bar:
            panel.add_patch(patches.Rectangle((x + 0.03, y + 0.05), 0.94, 0.9, fill=False, edgecolor="black", linewidth=1.1))
        text = "" if row["verdict"] == "faults" else tables.why(row)
        panel.text(x + 0.5, y + 0.5, text.replace(" +", "\n+"), ha="center", va="center", fontsize=6)
    panel.set_xlim(0, len(column_names))
    panel.set_ylim(len(row_names), 0)
    panel.set_xticks([k + 0.5 for k in range(len(column_names))], column_names, fontsize=7, rotation=30, ha="right")
    panel.set_yticks([k + 0.5 for k in range(len(row_names))], row_names, fontsize=7)
    panel.tick_params(length=0)
    for spine in panel.spines.values():
        spine.set_visible(False)


def draw_table(rows):
    """One figure: the methods on the first backend."""
    own = select(rows, backend=distinct(rows, "backend")[0])
    methods, row_names, column_names = distinct(own, "method"), distinct(own, "row"), distinct(own, "column")
    columns = min(len(methods), 3)
    lines = (len(methods) + columns - 1) // columns
    width = columns * (CELL_IN[0] * len(column_names) + 0.09 * max(len(name) for name in row_names) + 0.3)
    height = lines * (CELL_IN[1] * len(row_names) + 0.85) + 0.7
    figure, axes = pyplot.subplots(lines, columns, figsize=(max(width, 7), height), squeeze=False)
    for unused in axes.flat[len(methods):]:
        unused.set_visible(False)
    for panel, method in zip(axes.flat, methods):
        draw_map(panel, select(own, method=method), row_names, column_names)
        panel.set_title(method, fontsize=9)
    figure.suptitle(f"{own[0]['title']} ({own[0]['row_axis']} down, {own[0]['column_axis']} across)", fontsize=10)
    figure.legend(handles=[patches.Patch(facecolor=colour, label=verdict) for verdict, colour in COLOURS.items()], loc="lower center",
                  ncols=len(COLOURS), fontsize=8, frameon=False)
    figure.tight_layout(rect=(0, 0.28 / height, 1, 1))
    return figure


def figures(rows):
    """(name, figure) of every table."""
    for table in distinct(rows, "table"):
        yield f"stability_{table}", draw_table(select(rows, table=table))
