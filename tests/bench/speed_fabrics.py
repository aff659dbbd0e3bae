"""What fabrics and garments cost, against the bare sheet."""

from statistics import median

from rows import distinct, markdown, milliseconds, select

COLUMNS = ["cloth", "particles", "cloths", "round", "ms", "bare_ms", "bare_particles"]
BAR = 2


def fabrics_text(rows):
    counts = distinct(rows, "cloths")
    lines = []
    for cloth in distinct(rows, "cloth"):
        line = [cloth, f"{select(rows, cloth=cloth)[0]['particles']:.0f}"]
        for count in counts:
            rounds = select(rows, cloth=cloth, cloths=count)
            ratio = median(row["ms"] / row["particles"] * row["bare_particles"] / row["bare_ms"] for row in rounds) if rounds else 0
            line += [milliseconds(median(row["ms"] for row in rounds)), f"{ratio:.2f}", "yes" if ratio <= BAR else "NO"] if rounds else ["–"] * 3
        lines.append(line)
    headings = ["cloth", "particles"]
    for count in counts:
        headings += [f"{count:.0f} cloths [ms]", "per particle", "holds"]
    return ["### Fabrics and garments\n",
            "REALTIME, backend cpu, all threads, swinging; all cloths in turn, medians of the rounds. Per particle: over that of the bare sheet. "
            f"Bar: {BAR:g}.\n",
            markdown(headings, lines)]
