"""The quantities of `drape_bench accuracy` whose values are known: bars, the worst errors, all values."""

import math

from accuracy_bars import Bar
from rows import distinct, markdown, millimetres, percent, select, two_digits

COLUMNS = {
    "accuracy_quantities": [
        "kind", "scene", "particles", "time_step_s", "backend", "method", "quantity", "unit", "value", "expected", "error",
        "relative_error"],
}
TEXT_COLUMNS = {"kind", "quantity", "unit"}
MOST_SCENES = 20  # of a kind whose values are all shown
# Kind, the rows that count, is the error relative, floor, aim, what the bar says.
BARS = [
    ("rest", lambda row: row["quantity"] == "tremble max", False, 5e-5, 1e-5, "trembles per frame²"),
    ("slope", lambda row: row["expected"] == 0, False, 1e-4, None, "holds at 1.02 × in 2 s"),
    ("slope", lambda row: row["expected"] != 0, True, 1e-3, None, "slides at 0.98 × as the closed form"),
    ("cantilever", lambda row: row["scene"].endswith("cells 16"), True, 0.05, 0.02, "drop at 16 cells"),
    ("drape", lambda row: "mesh" in row["scene"], False, 0.02, 0.01, "drape coefficient, grid against mesh"),
    ("sag_by_side", lambda row: True, True, 0.05, 0.02, "the same at any resolution"),
    ("sag_by_step", lambda row: True, True, 0.05, 0.02, "the same at any time step"),
]


def known(rows, **wanted):
    """Rows with an expected value."""
    return [row for row in select(rows, **wanted) if math.isfinite(row["expected"])]


def error(row, is_relative):
    """Infinite for a cloth that is faulted."""
    value = abs(row["relative_error"] if is_relative else row["error"])
    return value if math.isfinite(value) else math.inf


def in_words(value, unit, is_relative):
    if not math.isfinite(value):
        return "faulted"
    if is_relative:
        return percent(value)
    return millimetres(value) if unit == "m" else two_digits(value)


def worst(some, is_relative):
    return max(some, key=lambda row: error(row, is_relative))


def quantity_bars(rows):
    bars = []
    for kind, counts, is_relative, floor, aim, says in BARS:
        some = [row for row in known(rows, kind=kind, method="REALTIME") if counts(row)]
        if not some:
            continue
        row = worst(some, is_relative)
        bars.append(Bar(f"{kind}, REALTIME: {says}", min(error(row, is_relative), 1e9), floor, aim,
                        lambda value, row=row, is_relative=is_relative: in_words(value if value < 1e9 else math.inf, row["unit"], is_relative),
                        note=f"worst of {len(some)}: {row['scene']}"))
    return bars


def worst_line(rows, kind, quantity, is_relative):
    line = [f"{kind}: {quantity}"]
    for method in distinct(rows, "method"):
        some = [row for row in known(rows, kind=kind, quantity=quantity, method=method) if (row["expected"] != 0) == is_relative]
        if not some:
            line.append("–")
            continue
        row = worst(some, is_relative)
        line.append(f"{in_words(error(row, is_relative), row['unit'], is_relative)} ({row['scene']})")
    return line


def values_text(rows, kind):
    methods = distinct(rows, "method")
    lines = []
    for scene in distinct(rows, "scene"):
        for quantity in distinct(select(rows, scene=scene), "quantity"):
            values = [select(rows, scene=scene, quantity=quantity, method=method) for method in methods]
            lines.append([f"{scene}: {quantity} [{values[0][0]['unit'] if values[0] else '-'}]",
                          *(f"{found[0]['value']:.3g}" if found else "–" for found in values)])
    return [f"{kind}:\n", markdown(["scene: quantity", *methods], lines)]


def quantities_text(rows):
    text = ["## Accuracy: quantities that are known\n",
            "Against closed forms; the sag and the drape of a fabric against the first of the same kind, which has the finest cells or "
            "the shortest step. What they are: tests/bench/notes/method.md.\n",
            markdown(["bar", "floor", "aim", "measured", "floor holds", "aim holds"], [bar.line() for bar in quantity_bars(rows)]),
            "The largest error of each preset, and where. In per cent of the expected value, unless that is zero:\n"]
    lines = []
    for kind in distinct(rows, "kind"):
        for quantity in distinct(select(rows, kind=kind), "quantity"):
            for is_relative in (False, True):
                if any((row["expected"] != 0) == is_relative for row in known(rows, kind=kind, quantity=quantity)):
                    lines.append(worst_line(rows, kind, quantity, is_relative))
    text.append(markdown(["kind: quantity", *distinct(rows, "method")], lines))
    for kind in distinct(rows, "kind"):
        some = select(rows, kind=kind)
        if len(distinct(some, "scene")) <= MOST_SCENES:
            text += values_text(some, kind)
    return text
