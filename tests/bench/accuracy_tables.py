"""The tables of `drape_bench accuracy` in words: the Pareto fronts, the bars, where the presets lose."""

import math

from rows import distinct, markdown, millimetres, milliseconds, percent, select, two_digits

COLUMNS = {
    "accuracy": [
        "scene", "particles", "duration_s", "backend", "family", "method", "substeps", "sweeps", "settings", "status",
        "repeats", "wall_ms_per_s", "wall_min_ms_per_s", "wall_max_ms_per_s", "iterations_per_frame", "max_strain",
        "rms_strain", "rms_position_m", "max_position_m", "energy_drift", "max_penetration_m",
        "midpoint_penetration_m"],
    "accuracy_references": ["scene", "solver", "time_s", "step_s", "change_m", "error_m", "took_s"],
    "accuracy_order": [
        "scene", "backend", "method", "substeps", "substep_s", "rms_position_m", "max_position_m", "order"],
    "accuracy_energy": ["scene", "backend", "method", "duration_s", "energy_drift"],
    "accuracy_creep": ["backend", "method", "duration_s", "creep_m"],
    "accuracy_split": [
        "scene", "method", "substeps", "sweeps", "algebraic_m", "discretisation_m", "total_m"],
}
TEXT_COLUMNS = {"scene", "backend", "family", "method", "settings", "status", "solver"}
CLEARLY_BETTER = 0.8  # of an error: what makes a point worth a word
PRESETS = ("PAPER", "REALTIME", "ACCURATE")
PEER = "bullet"
POSITION_ERROR_M = 1e-3  # "equal error" of the bar of ACCURATE

# How a diagram shows a scene: column, axis label, format of a value.
ERRORS = {
    "rms_position_m": ("RMS position error", millimetres),
    "rms_strain": ("RMS strain", percent),
    "max_strain": ("max strain", percent),
}
# Below, strains in single precision are noise: no point is better than that.
ROUND_OFF = {"rms_strain": 1e-6, "max_strain": 3e-6}


def main_backend(rows):
    """The backend that all methods ran on: the first."""
    return rows[0]["backend"]


def points(rows, scene, error):
    """Complete points of a scene that have this error: those of the main backend, and those of the peer."""
    least = ROUND_OFF.get(error, 0)
    some = [{**row, error: max(row[error], least)} for row in select(rows, scene=scene, status="ok") if math.isfinite(row[error])]
    return select(some, backend=main_backend(rows)), select(some, backend=PEER)


def pareto_front(some, error):
    """Points that no other beats in both time and error, from the cheapest to the most accurate."""
    front = []
    for row in sorted(some, key=lambda row: (row["wall_ms_per_s"], row[error])):
        if not front or row[error] < front[-1][error]:
            front.append(row)
    return front


def front_in_words(front, error):
    """Neighbours on the front of one family together: «first … last (times: errors)». Points that are hardly better than
    the one before are left out."""
    write = ERRORS[error][1]
    runs, last_error = [], math.inf
    for row in front:
        if row[error] > CLEARLY_BETTER * last_error:
            continue
        last_error = row[error]
        if runs and runs[-1][0]["family"] == row["family"]:
            runs[-1].append(row)
        else:
            runs.append([row])
    words = []
    for run in runs:
        first, last = run[0], run[-1]
        times = milliseconds(first["wall_ms_per_s"])
        errors = write(first[error])
        name = first["method"]
        if len(run) > 1:
            name += " … " + last["method"].split()[-1]
            times += " … " + milliseconds(last["wall_ms_per_s"])
            errors += " … " + write(last[error])
        words.append(f"{name} ({times} ms/s: {errors})")
    return "; ".join(words)


def least_error(some, error, most_ms_per_s):
    return min((row for row in some if row["wall_ms_per_s"] <= most_ms_per_s), key=lambda row: row[error], default=None)


def preset_in_words(preset, own, error):
    """The best setting of ours that takes no longer than the preset, and how much more accurate it is."""
    found = select(own, method=preset)
    if not found:
        return None
    row = found[0]
    best = least_error(own, error, row["wall_ms_per_s"])
    here = f"{preset} {milliseconds(row['wall_ms_per_s'])} ms/s, {ERRORS[error][1](row[error])}"
    if CLEARLY_BETTER * row[error] <= best[error]:
        return here + (": on the front" if best is row else f": within {100 * (1 - CLEARLY_BETTER):.0f} % of the front")
    factor = row[error] / best[error]
    return here + f": {factor:.{1 if factor < 100 else 0}f} times the error of {best['method']} ({milliseconds(best['wall_ms_per_s'])} ms/s)"


def losses(rows, scene):
    """Sentences on what is bad in a scene: more than 1 % of strain, or the peer is better in no more time."""
    words = []
    for row in select(rows, scene=scene, method="REALTIME", backend=main_backend(rows)):
        if row["status"] != "ok":
            words.append(f"REALTIME: {row['status']}")
        elif row["max_strain"] > 0.01:
            words.append(f"REALTIME stretches by up to {percent(row['max_strain'])}")
    for error in ERRORS:
        own, peer = points(rows, scene, error)
        for row in select(own, method="REALTIME"):
            better = least_error(peer, error, row["wall_ms_per_s"])
            if better is not None and better[error] < row[error]:
                words.append(f"{better['method']} has less {ERRORS[error][0]} than REALTIME in no more time "
                             f"({ERRORS[error][1](better[error])}, {milliseconds(better['wall_ms_per_s'])} ms/s)")
        better = [p for p in pareto_front(peer, error)
                  if (best := least_error(own, error, p["wall_ms_per_s"])) is None or p[error] < best[error]]
        if better and own:
            words.append(f"no setting of ours reaches the {ERRORS[error][0]} of {better[0]['method']} in its time")
    return words


def scenes_text(rows):
    text = ["### Fronts\n",
            "Points that no other setting of the same backend beats in both time and error, from the cheapest to the most accurate. "
            "Only points that are better by at least a fifth are named. «16x2» is 16 substeps of 2 sweeps; times are wall ms per "
            "simulated second. Settings that would have taken too long for a play, and cloths that blew up, are marked.\n"]
    for scene in distinct(rows, "scene"):
        some = select(rows, scene=scene)
        lines = [f"- **{scene}**, {some[0]['particles']:.0f} particles, {some[0]['duration_s']:g} s:"]
        has_positions = bool(points(rows, scene, "rms_position_m")[0])
        for error, (label, _) in ERRORS.items():
            own, peer = points(rows, scene, error)
            if not own or (has_positions and error == "rms_strain"):
                continue
            lines.append(f"  - {label}: {front_in_words(pareto_front(own, error), error)}.")
            verdicts = [v for v in (preset_in_words(preset, own, error) for preset in PRESETS) if v]
            if peer:
                best = pareto_front(peer, error)
                verdicts.append(f"Bullet: {front_in_words(best, error)}")
            lines.append("    " + ". ".join(verdicts) + ".")
        for status in ("over_time", "faulted"):
            bad = [row["method"] for row in select(some, status=status)]
            if bad:
                lines.append(f"  - {status}: {', '.join(bad)}.")
        text.append("\n".join(lines))
    return [*text, ""]


def losses_text(rows):
    lines = [f"- {scene}: {'; '.join(words)}." for scene in distinct(rows, "scene") if (words := losses(rows, scene))]
    return ["### Where we lose\n", *(lines or ["Nowhere among these scenes."]), ""]


def contacts_text(rows):
    """The peer and the presets on the scenes with colliders: penetration beside strain."""
    lines = []
    for row in rows:
        shown = row["backend"] == PEER or (row["backend"] == main_backend(rows) and row["method"] in PRESETS)
        if shown and row["status"] == "ok" and math.isfinite(row["max_penetration_m"]):
            lines.append([f"{row['scene']}: {row['method']}", milliseconds(row["wall_ms_per_s"]), percent(row["max_strain"]),
                          percent(row["rms_strain"]), two_digits(1000 * row["max_penetration_m"]),
                          two_digits(1000 * row["midpoint_penetration_m"])])
    if not lines:
        return []
    return ["### Contacts\n", markdown(["scene: method", "ms/s", "max strain", "RMS strain", "deepest particle [mm]",
                                        "deepest middle of an edge [mm]"], lines)]


def parity_text(rows):
    """Scenes that several backends played: the presets side by side."""
    lines = []
    for scene in distinct(rows, "scene"):
        some = [row for row in select(rows, scene=scene) if row["backend"] != PEER]
        backends = distinct(some, "backend")
        if len(backends) < 2:
            continue
        for preset in PRESETS:
            for row in select(some, method=preset):
                result = [row["status"], "", ""] if row["status"] != "ok" else [
                    milliseconds(row["wall_ms_per_s"]), percent(row["rms_strain"]),
                    ERRORS["rms_position_m"][1](row["rms_position_m"])]
                lines.append([f"{scene}: {preset}, {row['backend']}", *result])
    if not lines:
        return []
    return ["### The same on every backend\n", markdown(["scene: preset, backend", "ms/s", "RMS strain", "RMS position error"], lines)]


def references_text(references):
    lines = [[r["scene"], r["solver"], f"{r['time_s']:g} s", f"{r['step_s']:.2g} s" if r["step_s"] > 0 else "adaptive",
              f"{r['change_m']:.1e}", f"{r['error_m']:.1e}", f"{r['took_s']:.1f}"] for r in references]
    return ["### The references of the positions\n",
            "«planar chain»: one angle per link, Runge-Kutta of fourth order, the step halved until converged. «direct»: SHAKE, every "
            "step solved by Newton's method and a sparse factorisation, extrapolated from the last two steps. Both are in "
            "double precision and share no code with the product.\n",
            markdown(["scene", "solver", "at", "finest step", "change by the last halving [m]", "estimated error [m]", "took [s]"],
                     lines)]


def slope(rows):
    """Order of convergence: least squares of log(error) over log(step)."""
    logs = [(math.log(r["substep_s"]), math.log(r["rms_position_m"])) for r in rows
            if math.isfinite(r["rms_position_m"]) and r["rms_position_m"] > 0]
    if len(logs) < 3:
        return math.nan
    mean_x, mean_y = (sum(values) / len(logs) for values in zip(*logs))
    return (sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x) ** 2 for x, _ in logs))


def orders(rows):
    """(backend, method, scene) -> order."""
    keys = dict.fromkeys((r["backend"], r["method"], r["scene"]) for r in rows)
    return {key: slope(select(rows, backend=key[0], method=key[1], scene=key[2])) for key in keys}


def order_text(rows):
    lines = []
    for (backend, method, scene), order in orders(rows).items():
        some = select(rows, backend=backend, method=method, scene=scene)
        errors = " / ".join(two_digits(1000 * r["rms_position_m"]) for r in some)
        lines.append([f"{scene}: {method}, {backend}", " / ".join(f"{r['substeps']:.0f}" for r in some), errors, f"{order:.2f}"])
    return ["### Order of convergence\n",
            "RMS position error at the end against the substeps of a frame of 1/60 s; order: slope of a straight line through "
            "all of them in the log-log plot. «tight»: sweeps until nothing changes at a tolerance of 1e-9.\n",
            "![order](accuracy_order.png)\n",
            markdown(["scene: method, backend", "substeps", "error [mm]", "order"], lines)]


def energy_text(energy, creep):
    lines = [[f"{r['scene']}: {r['method']}", f"{r['duration_s']:g} s", two_digits(100 * r["energy_drift"]) + " %"] for r in energy]
    text = ["### Energy\n", "Largest change of the energy at any frame, in units of m g l, without damping; negative: lost.\n",
            markdown(["scene: method", "over", "change"], lines)]
    lines = [[r["method"], f"{r['duration_s']:g} s", millimetres(r["creep_m"])] for r in creep]
    return [*text, "A patch on an incline of 0.3 under friction of 0.5 creeps:\n", markdown(["method", "in", "by"], lines)]


def split_text(rows):
    text = ["### Two parts of the error\n",
            "RMS position error in mm on the backend `reference`: algebraic (against converged sweeps of the same step) + "
            "discretisation (of those against the exact motion). The parts need not add up: they may have opposite signs.\n",
            "![two parts](accuracy_split.png)\n"]
    for scene in distinct(rows, "scene"):
        for method in distinct(select(rows, scene=scene), "method"):
            some = select(rows, scene=scene, method=method)
            lines = []
            for substeps in distinct(some, "substeps"):
                row = select(some, substeps=substeps)
                lines.append([f"{substeps:.0f}", two_digits(1000 * row[0]["discretisation_m"]),
                              *(two_digits(1000 * r["algebraic_m"]) for r in row)])
            text.append(f"{scene}, {method}:\n")
            text.append(markdown(["substeps", "discretisation", *(f"algebraic, {sweeps:.0f} sweeps" for sweeps in
                                                                   distinct(some, "sweeps"))], lines))
    return text
