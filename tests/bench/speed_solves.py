"""How much of the machine the solver uses: its solves per second against the limits of the same run."""

from rows import markdown, select

COLUMNS = ["backend", "device", "limit", "threads", "size_bytes", "rate_per_s", "unit"]

# One constraint in one sweep, counted in the code (tests/bench/notes/method.md, «Speed»): divisions, square roots,
# other floating-point operations, bytes of particles (in the second level cache, shared memory or storage buffers) and
# bytes of the solver's own working memory of a strip (first level cache, or storage buffers).
STRIPS, COLOURS = "strips", "colours"
SOLVES = {
    ("lanes", STRIPS): {"divides": 2, "roots": 1, "flops": 67, "particle_bytes": 48, "work_bytes": 40},
    ("lanes", COLOURS): {"divides": 2, "roots": 1, "flops": 39, "particle_bytes": 72, "work_bytes": 0},
    ("single", STRIPS): {"divides": 2, "roots": 1, "flops": 67, "particle_bytes": 64, "work_bytes": 40},
    ("single", COLOURS): {"divides": 2, "roots": 1, "flops": 39, "particle_bytes": 96, "work_bytes": 0},
    ("resident", STRIPS): {"divides": 2, "roots": 1, "flops": 67, "particle_bytes": 56, "work_bytes": 40},
    ("resident", COLOURS): {"divides": 2, "roots": 1, "flops": 39, "particle_bytes": 80, "work_bytes": 8},
    ("tiled", STRIPS): {"divides": 2, "roots": 1, "flops": 67, "particle_bytes": 56, "work_bytes": 40},
    ("tiled", COLOURS): {"divides": 2, "roots": 1, "flops": 39, "particle_bytes": 80, "work_bytes": 12},
}
SWEEP_OF_PRESET = {"REALTIME": STRIPS, "PAPER": COLOURS}


def number(value):
    for unit, scale in (("T", 1e12), ("G", 1e9), ("M", 1e6)):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value:.3g} "


def size(value):
    return f"{value / 2**20:.0f} MiB" if value >= 2**20 else f"{value / 2**10:.0f} KiB"


def rate(limits, backend, limit, threads, size_bytes=None):
    found = [row for row in select(limits, backend=backend, limit=limit, threads=threads)
             if size_bytes is None or row["size_bytes"] == size_bytes]
    return found[0]["rate_per_s"] if found else None


def limits_text(rows):
    text = ["### The machine's limits\n", "Measured in the same run, the best of three.\n"]
    lines = []
    for row in rows:
        name = row["limit"] + (f", {size(row['size_bytes'])}" if row["size_bytes"] else "")
        where = f"{row['backend']} ({row['device']})" + (f", {row['threads']:.0f} thread{'s' if row['threads'] > 1 else ''}"
                                                         if row["threads"] else "")
        lines.append([f"{where}: {name}", f"{number(row['rate_per_s'])}{row['unit']}/s"])
    return [*text, markdown(["limit", "rate"], lines)]


def solves_per_s(row):
    return 1000 * row["cloths"] * row["constraints"] * row["iterations"] / row["median_ms"]


def share(part, whole):
    return f"{100 * part / whole:.0f} %" if whole else "–"


def cpu_shares(limits, solves, counts, threads):
    """Shares of the time that each limit alone would take."""
    def of(limit, size_bytes=None):
        return rate(limits, "cpu", limit, threads, size_bytes)
    divide, root, flops = of("divide"), of("square root"), of("multiply and add")
    copies = sorted(row["size_bytes"] for row in select(limits, backend="cpu", limit="copy", threads=threads))
    second_level = of("copy", copies[1]) if len(copies) > 1 else None
    slow = divide and root and 1 / (counts["divides"] / divide + counts["roots"] / root)
    return [share(solves, slow), share(solves * counts["flops"], flops),
            share(solves * (counts["particle_bytes"] + counts["work_bytes"]), second_level)]


def gl_shares(limits, solves, counts, path):
    copy, flops, shared = (rate(limits, "gl", name, 0) for name in ("copy", "fused multiply-add", "shared memory"))
    particles = solves * counts["particle_bytes"]
    work = solves * counts["work_bytes"]
    if path == "resident":
        return ["–", share(solves * counts["flops"], flops), f"{share(work, copy)}, shared {share(particles, shared)}"]
    return ["–", share(solves * counts["flops"], flops), share(work + particles, copy)]


def best_rows(cost):
    """The row with the most solves per second of each way of stepping and preset."""
    best = {}
    for row in cost:
        if row["preset"] not in SWEEP_OF_PRESET or row["faulted"]:
            continue
        key = (row["preset"], row["backend"], row["path"], row["threads"])
        if key not in best or solves_per_s(row) > solves_per_s(best[key]):
            best[key] = row
    return best


def solves_text(limits, cost):
    lines = []
    for (preset, backend, path, threads), row in best_rows(cost).items():
        counts = SOLVES[(path, SWEEP_OF_PRESET[preset])]
        solves = solves_per_s(row)
        shares = cpu_shares(limits, solves, counts, threads) if backend == "cpu" else gl_shares(limits, solves, counts, path)
        name = f"{backend} {path}" + (f", {threads:.0f} thread{'s' if threads > 1 else ''}" if threads else "")
        lines.append([f"{preset}: {name} ({row['cloths']:.0f} × {row['particles']:.0f})", f"{number(solves)}/s",
                      f"{counts['divides']} + {counts['roots']}", f"{counts['flops']}",
                      f"{counts['particle_bytes']} + {counts['work_bytes']}", *shares])
    return ["### Solves against the limits\n",
            "A solve is one constraint in one sweep. Each row is the size (cloths × particles) with the most solves per second of its way "
            "of stepping, in whole steps: what a step does beside sweeping counts as time too. The last columns are how much of each limit "
            "alone that uses: divisions and square roots one after the other (each rounded exactly, as equal results everywhere need); "
            "multiplications and additions (separately rounded on the cpu); bytes against the copy rate of the second level cache (cpu) or "
            "of buffers (gl).\n",
            markdown(["preset: way of stepping (size)", "solves", "divisions + roots", "other operations", "bytes: particles + own",
                      "of divide and root", "of multiply and add", "of bytes"], lines)]
