"""Draws the tables of `drape_bench contact`: what each frame took, with self-collision and without."""

from matplotlib import pyplot

from contact_tables import name_of
from rows import select

PANEL_IN = (4.6, 2.9)


def draw_contact(rows, frames):
    columns = min(3, len(rows))
    lines = (len(rows) + columns - 1) // columns
    figure, axes = pyplot.subplots(lines, columns, figsize=(PANEL_IN[0] * columns, PANEL_IN[1] * lines), squeeze=False)
    for unused in axes.flat[len(rows):]:
        unused.set_visible(False)
    for panel, row in zip(axes.flat, rows):
        own = select(frames, scene=row["scene"], side=row["side"], cloths=row["cloths"], substeps=row["substeps"])
        xs = [frame["frame"] / 60 for frame in own]
        panel.plot(xs, [frame["ms"] for frame in own], color="tab:blue", linewidth=1.1, label="with self-collision")
        panel.plot(xs, [frame["bare_ms"] for frame in own], color="tab:gray", linewidth=1.1, label="without")
        panel.set_yscale("log")
        panel.set_ylabel("ms per frame", fontsize=8)
        pairs = panel.twinx()
        pairs.fill_between(xs, [frame["near_pairs"] for frame in own], color="tab:orange", alpha=0.25, linewidth=0)
        pairs.set_ylim(0, max(1, row["most_near_pairs"]) * 2.5)
        pairs.tick_params(labelsize=7)
        panel.tick_params(labelsize=7)
        panel.set_title(f"{name_of(row)}, {row['substeps']:.0f} substeps", fontsize=9)
        panel.set_xlabel("s", fontsize=8)
        panel.set_zorder(pairs.get_zorder() + 1)
        panel.patch.set_visible(False)
    axes.flat[0].legend(fontsize=7, loc="upper left")
    # Above the titles of the panels, however many rows there are.
    figure.suptitle("Self-collision: time per frame, and near pairs (orange, right)", fontsize=10, y=1 + 0.05 / lines)
    return figure


# Tables that must have rows.
DRAWINGS = {"contact": (draw_contact, ["contact", "contact_frames"])}
