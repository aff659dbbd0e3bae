"""Tables of drape_bench as rows, and rows as Markdown. Only the standard library."""

import csv
import pathlib
import textwrap

COLUMNS_OF_A_PAGE = 120


def read_table(folder, name, columns, text_columns):
    """Rows of folder/name.csv as dictionaries, numbers as float; None where there is no such file.
    ValueError names a file whose columns are not those of this version or whose rows are broken."""
    path = pathlib.Path(folder) / (name + ".csv")
    if not path.exists():
        return None
    with open(path, newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != columns:
            raise ValueError(f"{path}: columns {reader.fieldnames} instead of {columns}")
        rows = []
        for number, row in enumerate(reader, start=2):
            if None in row or None in row.values():
                raise ValueError(f"{path}:{number}: not one value per column")
            rows.append({key: value if key in text_columns else float(value) for key, value in row.items()})
    return rows


def distinct(rows, column):
    """Values of a column in order of first appearance."""
    return list(dict.fromkeys(row[column] for row in rows))


def select(rows, **wanted):
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def milliseconds(value):
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}" if value < 1 else f"{value:.1f}"


def percent(value):
    return f"{100 * value:.0f} %" if value >= 0.1 else f"{100 * value:.2g} %"


def two_digits(value):
    """1200, 12, 1.2, 0.012, 1.2e-06."""
    return f"{value:.0f}" if abs(value) >= 99.5 else f"{value:.2g}"


def millimetres(value_m):
    return two_digits(1000 * value_m) + " mm"


def markdown(header, lines):
    rule = ["---"] + ["---:"] * (len(header) - 1)
    return "\n".join("| " + " | ".join(line) + " |" for line in [header, rule, *lines]) + "\n"


def wrapped(page):
    """The page with no line over COLUMNS_OF_A_PAGE, tables and headings apart. No line of a list begins with a sign that
    would make it an item of its own."""
    lines = []
    for line in page.split("\n"):
        if len(line) <= COLUMNS_OF_A_PAGE or line.startswith(("|", "#")):
            lines.append(line)
            continue
        indent = len(line) - len(line.lstrip(" "))
        if line[indent:].startswith("- "):
            indent += 2
        kept = line.lstrip(" ").replace(" + ", "\u00a0+ ").replace(" - ", "\u00a0- ")
        lines.append(textwrap.fill(kept, COLUMNS_OF_A_PAGE, initial_indent=line[:len(line) - len(line.lstrip(" "))],
                                   subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)
                     .replace("\u00a0", " "))
    return "\n".join(lines)
