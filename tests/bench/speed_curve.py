"""The table of the curve in words: time against strain of hanging cloths, beside Bullet; and the results of peers.py."""

import math

from rows import markdown, percent, select

COLUMNS = [
    "program", "family", "method", "settings", "status", "cloths", "particles", "us_one_thread", "us_all_threads", "iterations",
    "max_strain", "rms_strain"]
FRAME_US = 1e6 / 60
STRAIN_BAR, CLOTHS_FLOOR, CLOTHS_AIM = 0.01, 64, 160


def ours(rows):
    return select(rows, program="cpu", status="ok")


def fastest(some, column, max_strain, rms_strain=math.inf):
    """The row that takes the least time of those with no more strain; None where there is none."""
    enough = [row for row in some if row["max_strain"] <= max_strain and row["rms_strain"] <= rms_strain]
    return min(enough, key=lambda row: row[column], default=None)


def front(some):
    """Rows that none beats in both time on one thread and max strain, from the fastest."""
    rows = []
    for row in sorted(some, key=lambda row: (row["us_one_thread"], row["max_strain"])):
        if not rows or row["max_strain"] < rows[-1]["max_strain"]:
            rows.append(row)
    return rows


def strains(row):
    return f"{percent(row['max_strain'])} / {percent(row['rms_strain'])}"


def line(row):
    times = [f"{row[key]:.0f}" if math.isfinite(row[key]) else "–" for key in ("us_one_thread", "us_all_threads")]
    return [row["method"], *times, strains(row) if row["status"] == "ok" else row["status"]]


def frame_text(rows, cpu_backend):
    best = fastest(ours(rows), "us_all_threads", STRAIN_BAR)
    if best is None:
        return f"No setting keeps the max strain below {percent(STRAIN_BAR)}.\n"
    count = int(FRAME_US / best["us_all_threads"])
    floor, aim = ("holds" if count >= bar else "does NOT hold" for bar in (CLOTHS_FLOOR, CLOTHS_AIM))
    return (f"**Cloths in a frame of 16.7 ms at a max strain of at most {percent(STRAIN_BAR)}: {count}** ({best['method']}, "
            f"{best['us_all_threads']:.0f} µs per cloth and frame, {strains(best)}; {cpu_backend}). Floor {CLOTHS_FLOOR}: {floor}; "
            f"aim {CLOTHS_AIM}: {aim}.\n")


def curve_text(rows, cpu_backend):
    first = rows[0]
    text = ["### Time against strain\n",
            f"{first['cloths']:.0f} sheets of {first['particles']:.0f} particles hang by two corners, each with its own gravity within 10° of "
            "straight down, released horizontally, stepped together for 4 s at 60 Hz. µs per cloth and frame (mean over the frames), with one "
            f"thread and with all, on {cpu_backend}; max / RMS strain of all cloths in the last second. The number after a family is its substeps.\n",
            "![curve](speed_curve.png)\n", frame_text(rows, cpu_backend),
            "#### The front\n",
            "Settings that none beats in both time on one thread and max strain:\n",
            markdown(["setting", "one thread [µs]", "all threads [µs]", "max / RMS strain"], [line(row) for row in front(ours(rows))]),
            "#### Presets and Bullet's soft body\n",
            markdown(["setting", "one thread [µs]", "all threads [µs]", "max / RMS strain"],
                     [line(row) for row in rows if row["family"] == row["method"] or row["program"] == "bullet"])]
    bad = [f"{row['method']} ({row['status']})" for row in rows if row["status"] != "ok"]
    return text + ([f"Not finished: {', '.join(bad)}.\n"] if bad else [])


def peers_text(rows):
    lines = [[f"{row['program']}, {row['settings']}", f"{1000 * row['ms_per_frame']:.0f}",
              strains(row) if row["status"] == "ok" else row["status"]] for row in rows]
    return ["### Other simulators\n",
            "One sheet of the same scene with simulators from pip, CPU time on one thread (`tests/bench/peers.py` says how each is set "
            "up); not in turn with the rows above. Each offers more than this scene needs: contacts, materials, gradients.\n",
            markdown(["program", "µs per cloth and frame", "max / RMS strain"], lines)]
