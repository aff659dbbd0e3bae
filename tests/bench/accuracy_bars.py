"""The bars of accuracy: what must hold (floor), what is aimed at, and what was measured."""

import math

import accuracy_tables as tables
from rows import markdown, millimetres, milliseconds, percent, select

NOT_MEASURED = "not measured"
NEVER = 1e9  # instead of a ratio of times, where the error is never reached


class Bar:
    """One line: a value that should be at most (or, is_least, at least) floor and aim. `condition`: None, or whether what the
    bar asks besides (time) holds; `note` says it in words."""

    def __init__(self, name, value, floor, aim, write, condition=None, note="", is_least=False):
        self.name, self.value, self.floor, self.aim = name, value, floor, aim
        self.write, self.condition, self.note, self.is_least = write, condition, note, is_least

    def holds(self, bound):
        if bound is None:
            return "–"
        if self.value is None or not math.isfinite(self.value):
            return NOT_MEASURED
        is_met = self.value >= bound if self.is_least else self.value <= bound
        return "yes" if is_met and self.condition is not False else "NO"

    def line(self):
        sign = "≥" if self.is_least else "≤"
        bounds = [f"{sign} {self.write(bound)}" if bound is not None else "–" for bound in (self.floor, self.aim)]
        is_known = self.value is not None and math.isfinite(self.value)
        measured = self.write(self.value) if is_known else NOT_MEASURED
        if self.note:
            measured += f" ({self.note})"
        return [self.name, *bounds, measured, self.holds(self.floor), self.holds(self.aim)]


def preset_bars(rows, scene, preset, time_factor, values):
    """Bars on one preset in no more than time_factor times the wall time of PAPER."""
    backend = tables.main_backend(rows)
    found = select(rows, scene=scene, backend=backend, method=preset, status="ok")
    paper = select(rows, scene=scene, backend=backend, method="PAPER", status="ok")
    row = found[0] if found else None
    condition, note = None, ""
    if row and paper:
        ratio = row["wall_ms_per_s"] / paper[0]["wall_ms_per_s"]
        condition = ratio <= time_factor
        note = f"{milliseconds(row['wall_ms_per_s'])} ms/s, {ratio:.2f} × PAPER" + ("" if condition else f" > {time_factor}")
    return [Bar(f"{scene}, {preset}: {label}", row[column] if row else None, floor, aim, write, condition, note)
            for column, label, floor, aim, write in values]


def time_for_error(some, error_m):
    """Wall time at which the error falls to error_m, between the two points around it in the log-log plot: (time, is_bound).
    is_bound: not reached, the time is that of the most expensive point. The cheapest point that suffices where all do."""
    front = tables.pareto_front(some, "rms_position_m")
    if not front:
        return None, False
    before = None
    for row in front:
        if row["rms_position_m"] <= error_m:
            if before is None:
                return row["wall_ms_per_s"], False
            x0, x1 = math.log(before["wall_ms_per_s"]), math.log(row["wall_ms_per_s"])
            y0, y1 = math.log(before["rms_position_m"]), math.log(max(row["rms_position_m"], 1e-12))
            share = (y0 - math.log(error_m)) / (y0 - y1)
            return math.exp(x0 + share * (x1 - x0)), False
        before = row
    return max(row["wall_ms_per_s"] for row in some), True


def equal_error_bars(rows):
    bars = []
    for scene in ("pendulum", "chain", "curtain_32", "swing_32"):
        own = tables.points(rows, scene, "rms_position_m")[0]
        of = {preset: time_for_error([r for r in own if r["family"] in (preset, preset + " finer")], tables.POSITION_ERROR_M)
              for preset in ("PAPER", "ACCURATE")}
        (paper, is_paper_bound), (accurate, is_accurate_bound) = of["PAPER"], of["ACCURATE"]
        value, note = None, ""
        if paper and accurate:
            # PAPER that never gets there needs even longer: the ratio is then an upper bound.
            value = NEVER if is_accurate_bound else accurate / paper
            note = (f"ACCURATE {'not in ' if is_accurate_bound else ''}{milliseconds(accurate)} ms/s, "
                    f"PAPER {'not in ' if is_paper_bound else ''}{milliseconds(paper)} ms/s")
        bars.append(Bar(f"{scene}, ACCURATE: wall time for a position error of 1 mm, of PAPER's", value, 0.1, None,
                        lambda ratio: "not reached" if ratio >= NEVER else f"{ratio:.2g}", note=note))
    return bars


def order_bars(rows, order):
    found = tables.orders(select(order or [], backend=tables.main_backend(rows)))
    return [Bar(f"{scene}, {method}: order of convergence", value, 1.8, None, lambda v: f"{v:.2f}", is_least=True)
            for (_, method, scene), value in found.items()]


def energy_bars(energy):
    bars = []
    for row in select(energy or [], method="ACCURATE"):
        floor, aim = (0.01, 0.002) if row["scene"].startswith("curtain_") else (0.03, 0.005)
        bars.append(Bar(f"{row['scene']}, ACCURATE: change of energy in {row['duration_s']:g} s / m g l", abs(row["energy_drift"]),
                        floor, aim, percent))
    return bars


def contact_bars(rows, creep):
    backend = tables.main_backend(rows)
    bars = []
    for row in select(rows, scene="sphere_33", backend=backend, method="REALTIME", status="ok"):
        bars.append(Bar("sphere_33, REALTIME: penetration of a particle, edges of 3 cm", row["max_penetration_m"], 2e-3, 2e-4,
                        millimetres, note=f"middle of an edge {millimetres(row['midpoint_penetration_m'])}"))
    for row in creep or []:
        bars.append(Bar(f"a sticking patch creeps in {row['duration_s']:g} s, {row['method']}", row["creep_m"], 1e-4, None, millimetres))
    return bars


def all_bars(rows, order, energy, creep):
    strain = [("max_strain", "max strain"), ("rms_strain", "RMS strain")]
    bars = preset_bars(rows, "two_corners_32", "REALTIME", 1,
                       [(*strain[0], 0.02, 0.003, percent), (*strain[1], 1e-3, 1e-4, percent)])
    bars += preset_bars(rows, "two_corners_128", "REALTIME", 2,
                        [(*strain[0], 0.1, 0.01, percent), (*strain[1], 4e-3, 3e-4, percent)])
    for scene, position, stretch in (("curtain_32", (1e-3, 1e-4), 0.002), ("curtain_128", (20e-3, 3e-4), 0.03)):
        bars += preset_bars(rows, scene, "REALTIME", 1,
                            [("rms_position_m", "RMS position error", *position, millimetres), (*strain[0], stretch, None, percent)])
    return bars + order_bars(rows, order) + equal_error_bars(rows) + energy_bars(energy) + contact_bars(rows, creep)


def bars_text(rows, order, energy, creep):
    bars = all_bars(rows, order, energy, creep)
    return ["### Bars\n",
            "«floor» must hold; «aim» is the goal. REALTIME must hold its bars in at most the wall time of PAPER (two_corners_128: "
            "twice); both were measured in turn in the same run.\n",
            markdown(["bar", "floor", "aim", "measured", "floor holds", "aim holds"], [bar.line() for bar in bars]),
            "The capstan and the other closed forms of friction are tests (`tests/physics`); `./run bench stability` covers faults and "
            "extremes.\n"]
