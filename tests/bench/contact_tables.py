"""Markdown of what `drape_bench contact` measured, and nvcloth_contact.py."""

from rows import distinct, markdown, milliseconds, percent, select

COLUMNS = {
    "contact": [
        "scene", "side", "cloths", "substeps", "thickness_mm", "mean_ms", "worst_ms", "bare_mean_ms", "touching_mean_ms", "frames_with_crossings",
        "max_strain", "strain_p99", "most_near_pairs", "faulted"],
    "contact_frames": ["scene", "side", "cloths", "substeps", "frame", "ms", "bare_ms", "near_pairs", "crossings", "max_strain"],
    "contact_nvcloth": ["scene", "program", "steps", "thickness_mm", "ms", "worst_ms", "frames", "frames_with_crossings", "max_strain"],
}
TEXT_COLUMNS = {"scene", "program"}
# Of the time of the same cloth without self-collision: (scene, side, cloths) -> most.
BARS = {("fold", 32, 1): 4, ("nothing", 32, 1): 1.15, ("fold", 32, 64): 5, ("fold", 64, 1): 6}
WORST_BAR = 4  # of the mean while folded
STRAIN_BAR = 0.03  # while folded


def name_of(row):
    return f"{row['scene']}, {row['cloths']:.0f} x {row['side']:.0f} x {row['side']:.0f}"


def ratio_of(row):
    return row["mean_ms"] / row["bare_mean_ms"]


def verdict(is_met):
    return "yes" if is_met else "**NO**"


def bars_text(rows):
    lines = []
    for row in rows:
        bar = BARS.get((row["scene"], row["side"], row["cloths"]))
        if bar is not None:
            lines.append([name_of(row) + ": times the bare cloth", f"{ratio_of(row):.2f}", f"<= {bar}", verdict(ratio_of(row) <= bar)])
        if row["scene"] == "fold" and row["cloths"] == 1:
            worst = row["worst_ms"] / row["mean_ms"]
            lines.append([name_of(row) + ": worst frame over the mean", f"{worst:.1f}", f"<= {WORST_BAR}", verdict(worst <= WORST_BAR)])
            lines.append([name_of(row) + ": strain", percent(row["max_strain"]), f"<= {percent(STRAIN_BAR)}",
                          verdict(row["max_strain"] <= STRAIN_BAR)])
    crossed = sum(row["frames_with_crossings"] for row in rows)
    lines.append(["all scenes: frames with a crossing", f"{crossed:.0f}", "0", verdict(crossed == 0)])
    return markdown(["bar", "measured", "wanted", "met"], lines)


def contact_text(rows, frames, nvcloth):
    lines = [[name_of(row), f"{row['substeps']:.0f}", milliseconds(row["mean_ms"]), milliseconds(row["worst_ms"]), milliseconds(row["bare_mean_ms"]),
              f"{ratio_of(row):.2f}", f"{row['frames_with_crossings']:.0f}", percent(row["max_strain"]), percent(row["strain_p99"]),
              f"{row['most_near_pairs']:.0f}", f"{row['faulted']:.0f}"] for row in rows]
    text = ["## Self-collision\n",
            f"Backend cpu, one thread, REALTIME, {rows[0]['thickness_mm']:g} mm thick; times of the thread per frame of 1/60 s, beside the same cloth "
            "without self-collision, frame by frame in turn.\n",
            bars_text(rows),
            markdown(["scene", "substeps", "mean ms", "worst ms", "bare ms", "ratio", "frames crossing", "max strain", "p99", "most pairs", "faulted"],
                     lines)]
    if frames:
        text.append("![time per frame](contact.png)\n")
    return text + (nvcloth_text(nvcloth) if nvcloth else [])


def nvcloth_text(rows):
    text = ["### Beside NvCloth\n",
            "One sheet of 32 x 32 in each scene, ms per frame by one thread, frames with a crossing, largest strain (`tests/bench/nvcloth_contact.py`, "
            "medians of three plays in turn). NvCloth keeps spheres around its particles apart, of the distance in the second column; steps: "
            "substeps, or its iterations.\n"]
    scenes = distinct(rows, "scene")
    lines = []
    for program in distinct(rows, "program"):
        for thickness in distinct(select(rows, program=program), "thickness_mm"):
            for steps in distinct(select(rows, program=program, thickness_mm=thickness), "steps"):
                cells = []
                for scene in scenes:
                    row = select(rows, program=program, thickness_mm=thickness, steps=steps, scene=scene)[0]
                    cells.append(f"{milliseconds(row['ms'])} · {row['frames_with_crossings']:.0f} · {percent(row['max_strain'])}")
                lines.append([program, f"{thickness:.1f} mm", f"{steps:.0f}", *cells])
    return text + [markdown(["program", "distance", "steps", *scenes], lines)]
