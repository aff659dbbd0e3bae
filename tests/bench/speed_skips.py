"""Savings from leaving out unneeded work, and the cost of looking for it."""

from rows import markdown, milliseconds

COLUMNS = ["skip", "backend", "cloths", "particles", "full_ms", "lean_ms", "same_state"]


def skips_text(rows):
    lines = [[row["skip"], row["backend"], f"{row['cloths']:.0f}", milliseconds(row["full_ms"]), milliseconds(row["lean_ms"]), f"{100 * row['lean_ms'] / row['full_ms']:.1f} %",
              "yes" if row["same_state"] else "no"] for row in rows]
    first = rows[0]
    return ["### What a scene does not need\n",
            f"Sheets of {first['particles']:.0f} particles, stepped as the server steps them (`DeviceLoop`): with it and without it, "
            "in turn, medians of a step; and whether the final states are bit for bit the same.\n",
            "- «early exit»: all sweeps, and until the errors are small.\n"
            "- «readback»: states after each step, and none, or fewer columns or rows.\n"
            "- «unchanged states»: positions in each answer, and a subscription, which sends changes only.\n"
            "- «variants»: features that change nothing in this scene, and code without them.\n"
            "- «shared topology»: a model for each sheet, and one for all (cpu: only those share lanes).\n"
            "- «colliders left out»: all colliders tested, and those out of reach left out.\n"
            "- «lists of regular strips»: lists of particles and rest lengths, read or not.\n"
            "- «a whole sheet or one half pinned»: two scenes, not a switch. Constraints between pins, and other work that pins do "
            "not need, are always left out.\n",
            markdown(["what", "backend", "sheets", "with [ms]", "without [ms]", "without / with", "same state"], lines)]
