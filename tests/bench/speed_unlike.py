"""What cloths cost that cannot read all numbers once for all lanes."""

from statistics import median

from rows import distinct, markdown, milliseconds, select

COLUMNS = ["difference", "particles", "cloths", "round", "like_ms", "unlike_ms"]
BAR = 1.2


def unlike_text(rows):
    lines = []
    for difference in distinct(rows, "difference"):
        for particles in distinct(select(rows, difference=difference), "particles"):
            rounds = select(rows, difference=difference, particles=particles)
            like, unlike = median(row["like_ms"] for row in rounds), median(row["unlike_ms"] for row in rounds)
            ratio = median(row["unlike_ms"] / row["like_ms"] for row in rounds)
            lines.append([difference, f"{particles:.0f}", milliseconds(like), milliseconds(unlike), f"{ratio:.2f}", "yes" if ratio <= BAR else "NO"])
    return ["### Cloths that are not equal\n",
            f"{rows[0]['cloths']:.0f} cloths, REALTIME, backend cpu, all threads; those that are equal and those that differ in turn, from the same "
            "states in every round; medians of the rounds. Bar: cloths that differ cost at most "
            f"{BAR:g} × equal ones.\n",
            markdown(["what differs", "particles", "equal [ms]", "different [ms]", "different / equal", "holds"], lines)]
