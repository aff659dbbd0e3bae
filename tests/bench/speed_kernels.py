"""Steps of the cloths whose kernels are counted, on the backend gl, one alone and many at once."""

from rows import distinct, markdown, milliseconds, select

COLUMNS = ["cloth", "shaders", "cloths", "particles", "rounds", "median_ms", "p10_ms", "p90_ms"]
TEXT_COLUMNS = {"cloth", "shaders"}


def kernels_text(rows, device):
    shaders = distinct(rows, "shaders")
    lines = []
    for cloth in distinct(rows, "cloth"):
        of_cloth = select(rows, cloth=cloth)
        for count in distinct(of_cloth, "cloths"):
            some = select(of_cloth, cloths=count)
            times = [select(some, shaders=name) for name in shaders]
            lines.append([f"{count:.0f} × {cloth}", f"{some[0]['particles']:.0f}",
                          *(milliseconds(found[0]["median_ms"]) if found else "" for found in times)])
    return ["### Kernels\n",
            f"ms per step of `gl` on {device}, REALTIME, of the cloths of tests/bench/kernels, each under its own gravity: medians of "
            f"{rows[0]['rounds']:.0f} turns (speed_kernels.csv).\n",
            markdown(["cloths", "particles of each", *shaders], lines)]
