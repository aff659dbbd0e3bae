"""Which local size (invocations per work group) the backend gl should use, and whether several small cloths per group pay."""

from rows import distinct, markdown, milliseconds, select

COLUMNS = ["preset", "plan", "kernels", "cloths", "particles", "local_size", "is_chosen", "rounds", "median_ms", "p10_ms", "p90_ms",
           "ns_per_particle"]
PACKING_COLUMNS = ["particles", "sheets_per_group", "sheets", "local_size", "rounds", "median_ms", "us_per_sheet"]
TEXT_COLUMNS = {"kernels"}
NEAR = 1.1  # a choice within a tenth of the best is not told apart from it


def loads(rows):
    """The rows of each load: those that took turns."""
    found = {}
    for row in rows:
        found.setdefault(tuple(row[key] for key in ("preset", "kernels", "cloths", "particles")), []).append(row)
    return found


def best_and_chosen(some):
    """The fastest row of a load and that of the product's choice, which is None where it was not measured."""
    chosen = [row for row in some if row["is_chosen"]]
    return min(some, key=lambda row: row["median_ms"]), chosen[0] if chosen else None


def verdict(some):
    best, chosen = best_and_chosen(some)
    if chosen is None:
        return f"best {best['local_size']:.0f}"
    ratio = chosen["median_ms"] / best["median_ms"]
    return f"{chosen['local_size']:.0f}: {ratio:.2f} × that of {best['local_size']:.0f}" + ("" if ratio <= NEAR else " **(worse)**")


def local_sizes_text(rows, device):
    sizes = sorted(distinct(rows, "local_size"))
    lines = []
    for (preset, kernels, cloths, particles), some in loads(rows).items():
        best, _ = best_and_chosen(some)
        cells = []
        for size in sizes:
            found = select(some, local_size=size)
            text = milliseconds(found[0]["ns_per_particle"] / 1000) if found else ""
            cells.append(f"**{text}**" if found and found[0] is best else text)
        what = ", the group that refines" if kernels == "refine" else ""
        lines.append([f"{preset}, {cloths:.0f} × {particles:.0f}, {some[0]['plan']}{what}", *cells, verdict(some)])
    return ["### Local sizes\n",
            f"Steps of `gl` on {device}, µs per particle and step, by invocations per work group: the sizes in turn, medians of "
            f"{rows[0]['rounds']:.0f} turns (speed_local_sizes.csv). Bold: the best. Last: the product's choice "
            "(server/solver/gl_compute/local_sizes.cpp) and its time over that of the best.\n",
            markdown(["cloths × particles", *(f"{size:.0f}" for size in sizes), "chosen"], lines)]


def packing_text(rows):
    lines = []
    for particles in distinct(rows, "particles"):
        of_size = select(rows, particles=particles)
        alone = min(row["us_per_sheet"] for row in select(of_size, sheets_per_group=1))
        for count in distinct(of_size, "sheets_per_group"):
            best = min(select(of_size, sheets_per_group=count), key=lambda row: row["us_per_sheet"])
            lines.append([f"{particles:.0f} particles, {count:.0f} per group", f"{best['local_size']:.0f}", f"{best['us_per_sheet']:.3g}",
                          f"{alone / best['us_per_sheet']:.2f}"])
    return ["#### Several small cloths per work group\n",
            "The possible gain: sheets without links between them as one cloth, whose work group then does the work of several "
            "cloths. REALTIME, each at its best local size (speed_packing.csv).\n",
            markdown(["sheets", "local size", "µs per sheet and step", "gain over one per group"], lines)]
