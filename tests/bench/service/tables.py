"""What `./run bench service` writes down: a table and a text per machine, of which a run replaces its own parts."""

import csv
import re


def table(rows):
    names = [name for name in dict.fromkeys(name for row in rows for name in row) if name != "part"]
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    for row in rows:
        lines.append("| " + " | ".join(f"{v:.3g}" if isinstance(v, float) else str(v) for v in (row.get(name, "") for name in names)) + " |")
    return "\n".join(lines) + "\n"


def write_csv(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows({key: f"{v:.6g}" if isinstance(v, float) else v for key, v in row.items()} for row in rows)


def rows_of(path):
    """Those of an earlier run, without what they leave empty."""
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return [{key: value for key, value in row.items() if value} for row in csv.DictReader(file)]


def sections_of(path):
    """Of an earlier text, by their titles; the one before the first has none."""
    if not path.exists():
        return {}
    return {part.splitlines()[0] if part.startswith("## ") else "": part.rstrip("\n") + "\n"
            for part in re.split(r"^(?=## )", path.read_text(), flags=re.MULTILINE)}


def write_results(folder, parts, part, rows, text, name):
    """Of one of the parts, beside what was found in others."""
    folder.mkdir(exist_ok=True)
    machine = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
    table_path, text_path = folder / f"{machine}.csv", folder / f"{machine}.md"
    write_csv(table_path, [row for row in rows_of(table_path) if row["part"] != part] + rows)
    texts = {"": "# The service\n", **sections_of(text_path), f"## {part}": text}
    order = ["", *(f"## {name}" for name in parts)]
    text_path.write_text("\n".join(texts[title] for title in order if title in texts))
    print(f"results are in {folder}", flush=True)
