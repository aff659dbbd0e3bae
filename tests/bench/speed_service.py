"""The table of the service in words: Step requests over localhost against the bare backend in the same run."""

from rows import markdown, milliseconds, select

COLUMNS = [
    "backend", "clients", "cloths", "particles", "view", "call", "under_way", "steps", "cloth_steps_per_s", "p50_ms", "p99_ms", "per_step_ms",
    "bare_ms", "bare_per_step_ms", "bare_mean_ms", "wall_ms", "queue_ms", "upload_ms", "device_ms", "readback_ms", "encode_ms", "empty_ms"]
PARTS = ["queue_ms", "upload_ms", "device_ms", "readback_ms", "encode_ms"]
BAR_CLOTHS = 64  # one client
BARS = {"positions": (0.15, 0.1), "acknowledgement": (0.05, None)}  # more wall time than the bare backend: bar, aim


def bare_rate(row):
    return 1000 * row["clients"] * row["cloths"] / row["bare_mean_ms"]


def extra(row):
    """Share of wall time above that of the bare backend, for the same cloths: of a Step of one client, of all Steps of several."""
    if row["clients"] == 1:
        return row["p50_ms"] / row["bare_ms"] - 1 if row["under_way"] == 1 else row["per_step_ms"] / row["bare_per_step_ms"] - 1
    return bare_rate(row) / row["cloth_steps_per_s"] - 1


def wire_ms(row):
    """gRPC in both processes and the network; None where the requests wait for one another on the way."""
    return row["wall_ms"] - sum(row[part] for part in PARTS) if row["under_way"] == 1 else None


def asking(row):
    return f"{row['view']}, {row['call']} {'one at a time' if row['under_way'] == 1 else 'two under way'}"


def bars_text(rows):
    lines = []
    for view, (bar, aim) in BARS.items():
        for row in select(rows, clients=1, cloths=BAR_CLOTHS, view=view):
            parts = {part.removesuffix("_ms"): row[part] for part in PARTS if part not in ("device_ms", "queue_ms")}
            if row["under_way"] == 1:
                parts |= {"queue": row["queue_ms"], "wire": wire_ms(row)}
            largest = max(parts, key=parts.get)
            lines.append([f"{BAR_CLOTHS} × {row['particles']:.0f}, {asking(row)}", f"{100 * extra(row):.1f} %", f"≤ {100 * bar:.0f} %",
                          "yes" if extra(row) <= bar else "NO",
                          "–" if aim is None else f"≤ {100 * aim:.0f} %: {'yes' if extra(row) <= aim else 'NO'}",
                          f"{largest}: {parts[largest]:.2g} ms",
                          f"{100 * row['empty_ms'] / row['bare_ms']:.1f} %" if row["under_way"] == 1 else "–"])
    return ["Wall time of a step of one client above that of the bare backend's step (one at a time: medians; two under way: medians of the "
            "mean of eight successive steps, as answers come in pairs), and the largest part beside the device. An empty Step is the cost of gRPC and of waking the threads alone:\n",
            markdown(["load", "above the bare step", "bar", "holds", "aim", "largest part", "empty Step"], lines)] if lines else []


def service_text(rows):
    def line(row):
        wire = wire_ms(row)
        return [f"{row['clients']:.0f} × {row['cloths']:.0f}, {asking(row)}", f"{row['cloth_steps_per_s']:.0f}", f"{bare_rate(row):.0f}",
                f"{100 * extra(row):.0f} %", milliseconds(row["p50_ms"]), milliseconds(row["p99_ms"]), *(f"{row[part]:.2g}" for part in PARTS),
                "–" if wire is None else f"{wire:.2g}", f"{row['empty_ms']:.2g}"]

    return ["### The service\n",
            f"`draped` with the backend {rows[0]['backend']} in a process of its own; clients × cloths of {rows[0]['particles']:.0f} particles, "
            "each client with a connection and a session, one step per request. Answers hold nothing but the acknowledgement, the positions "
            "of all particles, or those at the four corners of each cloth (corners). One at a time: a client sends the next Step when it has the "
            "answer, by single calls of Step or on a StepStream. Two under way: on a StepStream the next request waits in the server while one is "
            "stepped; queue then includes the step before. p50 and p99 on a StepStream are between answers. All and the bare backend (as "
            "many cloths in this process) in turn. The parts are means per Step, from `StepResponse.timing`: queue, upload, device, "
            "readback, encode (making the answer, and waiting for it); wire is the rest of the wall time: gRPC in both processes and the "
            "network. «empty» is a Step of a session without cloths after a pause as long as the bare step, median: transport only.\n", *bars_text(rows),
            markdown(["clients × cloths, view", "cloth-steps/s", "bare", "more time", "p50 [ms]", "p99 [ms]", "queue", "upload", "device",
                      "readback", "encode", "wire [ms]", "empty [ms]"], [line(row) for row in rows])]
