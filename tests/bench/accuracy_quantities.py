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
FAULTED = 1e9  # instead of an error
MOST_SCENES = 20  # of a kind whose values are all shown


def is_carried(row):
    """The cloth has gone so far since it started."""
    return " carried " in row["scene"]


# Kind, the rows that count, floor, aim, what the bar says.
BARS = [
    ("rest", lambda row: row["quantity"] == "tremble max", 5e-5, 1e-5, "trembles per frame²"),
    ("slope", lambda row: row["quantity"] == "creep" and not is_carried(row), 1e-4, None, "holds at 1.02 × for 2 s"),
    ("slope", lambda row: row["quantity"] == "slide" and not is_carried(row), 1e-3, None, "slides at 0.98 × as the closed form"),
    ("slope", lambda row: row["quantity"] == "creep" and is_carried(row), 1e-4, None, "carried there from the origin, holds"),
    ("slope", lambda row: row["quantity"] == "slide" and is_carried(row), 1e-3, None, "carried there from the origin, slides"),
    ("capstan", lambda row: row["scene"].endswith("dynamic 100 % of it"), 1e-4, None, "sinks in a second at 0.98 ×"),
    ("caught", lambda row: True, 0.15, 0.05, "largest strain, ball of up to 3 times the mass"),
    ("cantilever", lambda row: row["scene"].endswith("cells 16"), 0.05, 0.02, "drop at 16 cells"),
    ("garment", lambda row: row["quantity"] == "strain p99", 0.01, 0.003, "99th percentile of strain"),
    ("garment", lambda row: row["quantity"] == "strain max", 0.05, 0.02, "largest strain"),
    ("drape", lambda row: "mesh" in row["scene"], 0.02, 0.01, "drape coefficient, mesh against grid or board"),
    ("sag_by_side", lambda row: True, 0.05, 0.02, "the same at any resolution"),
    ("sag_by_step", lambda row: True, 0.05, 0.02, "the same at any time step"),
]


def known(rows, **wanted):
    """Rows with an expected value."""
    return [row for row in select(rows, **wanted) if math.isfinite(row["expected"])]


def is_relative(row):
    """The error of lengths that are not to be 0 is in per cent of what is expected."""
    return row["unit"] == "m" and row["expected"] != 0


def error(row):
    value = abs(row["relative_error"] if is_relative(row) else row["error"])
    return value if math.isfinite(value) else FAULTED


def in_words(value, row):
    if value >= FAULTED:
        return "faulted"
    if is_relative(row):
        return percent(value)
    return millimetres(value) if row["unit"] == "m" else two_digits(value)


def quantity_bars(rows):
    bars = []
    for kind, counts, floor, aim, says in BARS:
        for method in ("REALTIME", "ACCURATE"):
            some = [row for row in known(rows, kind=kind, method=method) if counts(row)]
            if some:
                worst = max(some, key=error)
                bars.append(Bar(f"{kind}, {method}: {says}", error(worst), floor, aim, lambda value, row=worst: in_words(value, row),
                                note=f"worst of {len(some)}: {worst['scene']}"))
    return bars


def worst_line(rows, kind, quantity):
    line = [f"{kind}: {quantity}"]
    for method in distinct(rows, "method"):
        some = known(rows, kind=kind, quantity=quantity, method=method)
        worst = max(some, key=error, default=None)
        line.append(f"{in_words(error(worst), worst)} ({worst['scene']})" if worst else "–")
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
            "The largest error of each preset, and where; of lengths in per cent, unless they should be 0.\n"]
    lines = [worst_line(rows, kind, quantity) for kind in distinct(rows, "kind")
             for quantity in distinct(known(rows, kind=kind), "quantity")]
    text.append(markdown(["kind: quantity", *distinct(rows, "method")], lines))
    for kind in distinct(rows, "kind"):
        some = select(rows, kind=kind)
        if len(distinct(some, "scene")) <= MOST_SCENES:
            text += values_text(some, kind)
    return text
