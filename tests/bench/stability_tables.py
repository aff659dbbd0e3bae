"""The rows of `drape_bench stability` in words. Only the standard library."""

from rows import distinct, markdown, percent, select, two_digits

COLUMNS = {"stability": [
    "table", "title", "row_axis", "row", "column_axis", "column", "backend", "method", "time_step_s", "substeps", "steps",
    "is_cut", "verdict", "violation", "in_bar", "max_strain", "end_strain", "max_gain", "end_gain", "warnings", "wall_s"],
    "stability_random": [
        "kind", "backend", "method", "cloths", "duration_s", "largest_gain", "worst_seed", "gaining", "not_finite", "faulted",
        "warned", "wall_s"]}
TEXT_COLUMNS = {"kind", "table", "title", "row_axis", "row", "column_axis", "column", "method", "verdict", "violation", "warnings"}

VERDICTS = {
    "survives": "strain at most 10 % (above what the case cannot avoid) and energy at most 0.1 m g l above the start, at every step",
    "recovers": "not at every step, but at every step of the last quarter",
    "warns": "neither, and a report says so (`not_converged`, `springs_beyond_limit`, `springs_gain_energy`)",
    "breaks": "neither, and no report says so",
    "faults": "FAULTED: stopped at its last good state, which stays readable"}
MAX_STRAIN, MAX_GAIN = 0.1, 0.1  # kMaxStrain and kMaxGain of tests/stability/atlas/trial.h


def is_good(row):
    return row["verdict"] in ("survives", "recovers")


def why(row):
    """The excess of a cell over the limits at the end; without one, its largest strain."""
    if row["verdict"] == "faults":
        return "faults"
    parts = []
    if row["end_strain"] > MAX_STRAIN:
        parts.append(percent(row["end_strain"]))
    if row["end_gain"] > MAX_GAIN:
        parts.append(f"+{two_digits(row['end_gain'])} mgl")
    return " ".join(parts) if parts else percent(row["max_strain"])


def counts(some):
    return " · ".join(str(len(select(some, verdict=verdict))) for verdict in VERDICTS)


def bar_text(rows):
    inside = [row for row in rows if row["in_bar"] == 1]
    failing = [row for row in inside if not is_good(row)]
    text = ["### The bar\n",
            "REALTIME survives or recovers at steps of at most 1/60 s, mass ratios of at most 1000, at most 100 g, and from every "
            f"degenerate start: {len(inside) - len(failing)} of {len(inside)} cells do."]
    if failing:
        text.append("The others:\n")
        text.append(markdown(["cell", "backend", "verdict", "at the end"],
                             [[f"{row['table']}: {row['row']}, {row['column']}", row["backend"], row["verdict"], why(row)]
                              for row in failing]))
    return text + [""]


def promises_text(rows):
    broken = [row for row in rows if row["violation"]]
    if not broken:
        return [f"In none of the {len(rows)} cells was a number read that is not finite, did a step not end, did the neighbour in the batch "
                "get other bits, or did the cloth move differently in the batch than alone.\n"]
    return ["**Broken promises:**\n", *(f"- {row['backend']}, {row['method']}, {row['table']}: {row['row']}, {row['column']}: "
                                        f"{row['violation']}" for row in broken), ""]


def realtime_text(own):
    """Where REALTIME neither survives nor recovers, row by row."""
    text = ["### Where REALTIME fails\n"]
    for table in distinct(own, "table"):
        some = select(own, table=table, method="REALTIME")
        if not some:
            continue
        lines = []
        for row in distinct(some, "row"):
            bad = [cell for cell in select(some, row=row) if not is_good(cell)]
            if bad:
                lines.append(f"  - {row}: " + ", ".join(f"{cell['column']} {cell['verdict']}" +
                                                        ("" if cell["verdict"] == "faults" else f" ({why(cell)})") for cell in bad))
        text.append(f"- **{table}** ({some[0]['title']}): " + ("nowhere" if not lines else ""))
        text += lines
    return text + [""]


def backends_text(rows, main):
    others = [name for name in distinct(rows, "backend") if name != main]
    text = []
    for backend in others:
        some = select(rows, backend=backend)
        differing = []
        for row in some:
            found = select(rows, backend=main, table=row["table"], row=row["row"], column=row["column"], method=row["method"])
            if found and found[0]["verdict"] != row["verdict"]:
                differing.append(f"{row['method']}, {row['table']}: {row['row']}, {row['column']} "
                                 f"({row['verdict']} {why(row)}; {main} {found[0]['verdict']} {why(found[0])})")
        text.append(f"`{backend}`, {len(some)} cells: the verdict of `{main}` in all but {len(differing)}" +
                    (":\n" + "\n".join(f"- {line}" for line in differing) if differing else ".") + "\n")
    return ["### The other backends\n", *text] if others else []


def stability_text(rows):
    main = distinct(rows, "backend")[0]
    own = select(rows, backend=main)
    text = ["## Stability\n",
            "Cases at and beyond the limits of a cloth (`tests/stability/atlas`), each beside a neighbour in one batch, every "
            "state read, judged by one rule:\n",
            *(f"- **{verdict}**: {meaning}" for verdict, meaning in VERDICTS.items()), ""]
    cut = [row for row in rows if row["is_cut"] == 1]
    if cut:
        text.append(f"{len(cut)} cells took too long and are judged by the steps until then.\n")
    text += promises_text(rows) + bar_text(rows) + realtime_text(own)
    methods = distinct(own, "method")
    text += [f"### Methods on `{main}`\n", "Cells that " + " · ".join(VERDICTS) + ":\n",
             markdown(["table", *methods], [[table, *(counts(select(own, table=table, method=method)) for method in methods)]
                                            for table in distinct(own, "table")])]
    text += backends_text(rows, main)
    text.append("### Maps\n")
    text.append("Largest strain, or the excess over the limits in the last quarter (strain, energy above the start); framed: the bar's cells.\n")
    return text + [f"![{table}](stability_{table}.png)\n" for table in distinct(own, "table")]


MAX_RANDOM_GAIN = 0.01  # kMaxRandomGain of tests/stability/atlas/random_trial.h


def random_text(rows):
    """What random cloths gain, a line per kind, method and backend."""
    text = ["## Random cloths\n",
            "Random linkages, frames, chains, trees, nets, sheets and meshes of inextensible links, undamped, masses up to 1 : 1000 "
            "(`tests/support/random_cloths.h`). Gain: the largest excess of kinetic and potential energy over those of the start, at "
            "the end of any step, over m g l plus the kinetic energy of the start. Warned: cloths with `energy_gained` in any "
            "report.\n"]
    for backend in distinct(rows, "backend"):
        some = select(rows, backend=backend)
        total = {key: f"{sum(row[key] for row in some):.0f}" for key in ("cloths", "gaining", "not_finite", "faulted")}
        text.append(f"`{backend}`, {total['cloths']} plays: {total['gaining']} gain more than {percent(MAX_RANDOM_GAIN)} of their "
                    f"scale, {total['not_finite']} reach a number that is not finite, {total['faulted']} are faulted.\n")
        methods = distinct(some, "method")
        lines = []
        for kind in distinct(some, "kind"):
            own = [select(some, kind=kind, method=method)[0] for method in methods if select(some, kind=kind, method=method)]
            lines.append([f"{kind} ({own[0]['cloths']:.0f} of {own[0]['duration_s']:.2g} s)"] +
                         [f"{percent(row['largest_gain'])}, {row['warned']:.0f} warned" for row in own])
        text.append(markdown(["largest gain", *methods], lines))
    return text
