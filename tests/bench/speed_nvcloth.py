"""The curve of hanging cloths beside NvCloth: published reference points, and what nvcloth.py measured on this machine."""

import nvcloth
from rows import markdown, percent, select
from speed_curve import fastest, ours, strains

COLUMNS = nvcloth.COLUMNS
# Reference points, NOT measured by nvcloth.py: one core of a machine of this class; their maxima are those of one sheet under gravity straight down.
# us per cloth and frame of 1/60 s, max strain, RMS strain, whether with geodesic tethers.
POINTS = [
    (80, 0.053, 0.007, True), (240, 0.084, 0.004, False), (310, 0.018, 0.001, True), (590, 0.012, 0.001, False),
    (1190, 0.007, 0.0006, False)]
BAR = 3  # times faster at equal or less strain


def against(rows, us, max_strain, rms_strain):
    """The fastest setting here with no more strain of either kind: its name, time and strains, how many times faster, whether BAR holds."""
    best = fastest(ours(rows), "us_one_thread", max_strain, rms_strain)
    if best is None:
        return ["no setting", "", "", "NO"]
    ratio = us / best["us_one_thread"]
    return [best["method"], f"{best['us_one_thread']:.0f} µs: {strains(best)}", f"{ratio:.1f}", "yes" if ratio >= BAR else "NO"]


def setting(row):
    return f"{row['iterations']:.0f} iterations" + (", tethers" if row["has_tethers"] else "")


def measured_text(rows, measured):
    crowd = [row for row in measured if row["cloths"] > 1]
    alone = {setting(row): row for row in measured if row["cloths"] == 1}
    first = crowd[0]
    lines = [[f"{setting(row)}: {row['us_one_thread']:.0f} µs", strains(row), strains(alone[setting(row)]),
              *against(rows, row["us_one_thread"], row["max_strain"], row["rms_strain"])] for row in crowd]
    return ["### NvCloth, measured\n",
            f"The same {first['cloths']:.0f} sheets with {first['program']} ({first['build']}; `tests/bench/nvcloth.py`, median of three plays, not "
            "in turn with the rows above): its usual cloth, which also has diagonals and bending; strain of the structural edges. One thread, µs per "
            "cloth and frame at max / RMS strain; and the strains of one sheet alone under gravity straight down. Beside each the fastest setting "
            "here with no more strain of either kind than the sheets have.\n",
            markdown(["NvCloth", "max / RMS strain", "one sheet alone", "fastest here", "one thread", "times faster", f"≥ {BAR}"], lines)]


def points_text(rows):
    lines = [[f"{us} µs: {strains({'max_strain': max_strain, 'rms_strain': rms_strain})}" + (", geodesic tethers" if has_tethers else ""),
              *against(rows, us, max_strain, rms_strain)] for us, max_strain, rms_strain, has_tethers in POINTS]
    return ["### NvCloth, reference points\n",
            "This program has NOT measured the figures of NvCloth (left): its usual cloth on one core of a machine of this class, µs per cloth and "
            "frame at max / RMS strain of one sheet under gravity straight down, which strains it less than tilted gravity. Beside each the fastest setting "
            f"here, one thread, with no more strain of either kind over all the sheets. Bar: at least {BAR} times faster.\n",
            markdown(["NvCloth (not measured here)", "fastest here", "one thread", "times faster", f"≥ {BAR}"], lines)]


def nvcloth_text(rows, measured):
    return (measured_text(rows, measured) if measured else []) + points_text(rows)
