"""Tables of what count.py counted: kernels.csv, stages.csv, amd.csv, README.md."""
import csv
import os

import amd
import gpus

COLUMNS = ["program", "arch", "local_size", "registers", "stack_bytes", "shared_bytes", "groups", "limited_by",
           "instructions", "substep", "per_particle", "step"]


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" + "|---:" * (len(head) - 1) + "|"]
    return lines + ["| " + " | ".join(str(value) for value in row) + " |" for row in rows]


def name_of(row):
    return row["program"].removesuffix(".resident_step")


def amd_section(folder, rows):
    """Writes amd.csv; returns the lines of the section."""
    with open(os.path.join(folder, "amd.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    text = ["## AMD", "", f"By RADV's compiler of Mesa {rows[0]['mesa']} for chips that are not there, from SPIR-V: "
            "[kernels/](../../kernels/README.md). Waves:", "that a SIMD holds at once. Instructions: of the code, each once.", ""]
    for family, card in amd.FAMILIES.items():
        of_family = [row for row in rows if row["family"] == family and row["program"].endswith(".resident_step")]
        text += [f"### {family} ({card})", ""]
        text += table(["cloth", "vector registers", "scalar registers", "spilled scalars", "scratch [B]", "shared [B]",
                       "waves", "instructions"],
                      [[name_of(row), row["vector_registers"], row["scalar_registers"], row["spilled_scalars"],
                        row["scratch_bytes"], row["shared_bytes"], row["waves_per_simd"], row["instructions"]]
                       for row in of_family]) + [""]
    return text[:-1]


def write(folder, counted, version, of_amd):
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "kernels.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(counted)
    steps = [row for row in counted if "stages" in row]
    with open(os.path.join(folder, "stages.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["program", "arch", "stage", "warp_instructions_per_substep"])
        for row in steps:
            writer.writerows([row["program"], row["arch"], stage, value] for stage, value in row["stages"].items())
    text = ["# What the kernels cost a GPU, counted", "",
            f"`./run bench kernels`, with NVRTC {version}. **Counted** from machine code, not measured on a GPU: how the",
            "counts are made and what they leave out is in [kernels/](../../kernels/README.md).", "",
            "## A step in one work group", "",
            "REALTIME, 32×32 particles but `small` (8×8). Instructions: of all warps of the group, of one substep; per "
            "particle:", "of the invocations. The last columns: cloths in 1/60 s if every scheduler issues one in every "
            "clock, an upper bound.", ""]
    names = list(gpus.GPUS)
    for arch in sorted({row["arch"] for row in steps}, key=lambda arch: int(arch[3:])):
        of_arch = [name for name in names if gpus.GPUS[name][0] == arch]
        text += [f"### {arch}", ""]
        text += table(["cloth", "registers", "stack [B]", "shared [B]", "groups", "limited by", "per substep",
                       "per particle"] + of_arch,
                      [[name_of(row), row["registers"], row["stack_bytes"], row["shared_bytes"], row["groups"],
                        row["limited_by"], row["substep"], row["per_particle"]] +
                       [round(gpus.cloths_at_60_hz(name, row["step"])) for name in of_arch]
                       for row in steps if row["arch"] == arch]) + [""]
    text += ["## By stage", "", "Warp instructions of a substep, sm_90.", ""]
    of_90 = [row for row in steps if row["arch"] == "sm_90"]
    stages = sorted({stage for row in of_90 for stage in row["stages"]},
                    key=lambda stage: -max(row["stages"].get(stage, 0) for row in of_90))
    text += table(["stage"] + [name_of(row) for row in of_90],
                  [[stage] + [row["stages"].get(stage, "") for row in of_90] for stage in stages]) + [""]
    tiled = [row for row in counted if row["arch"] == "sm_90" and "stages" not in row]
    text += ["## Kernels of the tiled plan", "", "sm_90. Instructions: of the code, each once.", ""]
    text += table(["kernel", "local size", "registers", "stack [B]", "shared [B]", "groups", "instructions"],
                  [[row["program"], row["local_size"], row["registers"], row["stack_bytes"], row["shared_bytes"],
                    row["groups"], row["instructions"]] for row in tiled])
    if of_amd:
        text += [""] + amd_section(folder, of_amd)
    with open(os.path.join(folder, "README.md"), "w", encoding="utf-8") as file:
        file.write("\n".join(text) + "\n")
