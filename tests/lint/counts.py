#!/usr/bin/env python3
"""Counts that say how much a change of this code costs, printed by `./run lint --counts`.

Files: product files are the code of server/, client/, shaders/ and proto/: no tests, no documents, no example
scenes. A file mentions a name if the name occurs outside its comments, in any case, as a part of any word.

Arrows: within server/solver/cpu one unit (x.h, x.cpp and x-inl.h; "arrow" = it includes a header of another one)
or one folder stands above those that it includes. The arrows that run back up are those that are left against the
best order, the one with the fewest of them.

Functions: from the opening to the closing line of a body, C++ and GLSL. Bodies are found by their braces.

Sequences of the step: functions that call both a prediction (...Predict...) and a solve (Solve..., Sweep...),
that is: bodies in which the order of the stages of a substep is written down.
"""
import collections
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CODE = (".h", ".cpp", ".comp", ".glsl", ".vert", ".frag", ".proto")
CPU = "server/solver/cpu/"
LONG = 60

# The counts before the refactoring for which they were written.
BEFORE = {
    "files that mention a collider shape (capsule)": 21,
    "files that mention a collider shape (cylinder)": 0,
    "files that mention a setting (twist_damping_per_s)": 9,
    "files that mention a setting (refine_above_strain)": 13,
    "files that mention a constraint kind (joint)": 60,
    "arrows between folders of server/solver/cpu": 0,
    "of these back up between folders": 0,
    "arrows between units of server/solver/cpu": 94,
    "of these back up between units": 13,
    "calls of ChooseSolver": 9,
    "virtual methods of Backend": 11,
    "functions": 2889,
    "functions of more than 60 lines": 2,
    "longest function, lines": 122,
    "written sequences of the step": 7,
    "lines of Markdown over 120 columns outside tables": 846,
    "lines of README.md": 140,
    "folder READMEs of more than 60 lines": 14,
    "longest README of a folder, lines": 351,
}


def tracked_files():
    output = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [path for path in output.splitlines() if os.path.exists(os.path.join(ROOT, path))]


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def without_comments(text):
    """Comments become blanks and strings empty; lines stay where they are."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"\(.*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)

    def blank(found):
        text = found.group()
        if text.startswith("/"):
            return re.sub(r"[^\n]", " ", text)
        return '""' + "\n" * text.count("\n")

    return pattern.sub(blank, text)


def product_files():
    tops = ("server/", "client/", "shaders/", "proto/drape/")
    return [path for path in tracked_files()
            if path.startswith(tops) and path.endswith(CODE) and not path.startswith("client/examples/")]


def code_without_comments(paths):
    comment = re.compile(r"//[^\n]*")
    return {path: comment.sub("", read(path)) for path in paths}


# --- functions


def functions(path, text):
    """(name, first line, last line, body) of every function of the text."""
    code = without_comments(text)
    code = re.sub(r"^[ \t]*#[^\n]*(?:\\\n[^\n]*)*", lambda m: "\n" * m.group().count("\n"), code, flags=re.M)
    head = re.compile(r"([~\w]+|operator\W{1,3})\s*\(")
    found, stack, start = [], [], 0
    for position, c in enumerate(code):
        if c == "{":
            before = code[start:position]
            name = None
            inside = any(entry[0] for entry in stack)
            if not inside and ")" in before and not before.rstrip().endswith(("=", ",", "(")):
                match = head.search(re.sub(r"template\s*<[^{};]*?>\s*(?=\w)", "", before))
                if match and match.group(1) not in ("if", "for", "while", "switch", "alignas", "layout"):
                    name = match.group(1)
            stack.append((name, position, code.count("\n", 0, start + len(before) - len(before.lstrip()))))
            start = position + 1
        elif c == "}":
            if stack:
                name, begin, first = stack.pop()
                if name:
                    last = code.count("\n", 0, position)
                    found.append((name, first + 1, last + 1, code[begin:position + 1]))
            start = position + 1
        elif c == ";":
            start = position + 1
    return found


# --- arrows


def unit_of(path):
    return re.sub(r"(-inl)?\.(h|cpp)$", "", path)


def arrows_of(node_of):
    """Pairs (from, to) of different nodes of which one includes the other."""
    arrows = set()
    for path in tracked_files():
        if not path.startswith(CPU) or not path.endswith((".h", ".cpp")):
            continue
        for include in re.findall(r'^\s*#\s*include\s*"([^"]+)"', read(path), flags=re.M):
            if include.startswith(CPU) and node_of(include) != node_of(path):
                arrows.add((node_of(path), node_of(include)))
    return arrows


def components(arrows):
    """The strongly connected components of more than one node (Tarjan)."""
    following = collections.defaultdict(list)
    for a, b in arrows:
        following[a].append(b)
    index, low, stack, on_stack, result = {}, {}, [], set(), []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        on_stack.add(node)
        for other in following[node]:
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in on_stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            component = set()
            while node not in component:
                component.add(stack.pop())
            on_stack.difference_update(component)
            if len(component) > 1:
                result.append(component)

    for node in sorted({node for arrow in arrows for node in arrow}):
        if node not in index:
            visit(node)
    return result


def back_arrows(arrows):
    """The fewest arrows against any order: exact per component of up to 18 nodes, by subsets."""
    back = []
    for component in components(arrows):
        nodes = sorted(component)
        if len(nodes) > 18:
            sys.exit(f"a circle of {len(nodes)} units is too large to be counted: {nodes}")
        place = {node: k for k, node in enumerate(nodes)}
        targets = [0] * len(nodes)
        for a, b in arrows:
            if a in component and b in component:
                targets[place[a]] |= 1 << place[b]
        # The nodes of a subset stand above all others; adding a node below them breaks its arrows into the subset.
        best = {0: (0, ())}
        for subset in range(1 << len(nodes)):
            cost, order = best[subset]
            for k in range(len(nodes)):
                if subset >> k & 1:
                    continue
                added = cost + bin(targets[k] & subset).count("1")
                if subset | 1 << k not in best or added < best[subset | 1 << k][0]:
                    best[subset | 1 << k] = (added, order + (k,))
        order = best[(1 << len(nodes)) - 1][1]
        back += [(a, b) for a, b in arrows
                 if a in component and b in component and order.index(place[b]) < order.index(place[a])]
    return sorted(back)


# --- the counts


def counts():
    result, details = {}, []
    paths = product_files()
    code = code_without_comments(paths)

    def mention(what, name):
        result[f"{what} ({name})"] = len([path for path in paths if name in code[path].lower()])

    mention("files that mention a collider shape", "capsule")
    mention("files that mention a collider shape", "cylinder")
    mention("files that mention a setting", "twist_damping_per_s")
    mention("files that mention a setting", "refine_above_strain")
    mention("files that mention a constraint kind", "joint")

    for what, node_of in (("folders", os.path.dirname), ("units", unit_of)):
        arrows = arrows_of(node_of)
        back = back_arrows(arrows)
        result[f"arrows between {what} of server/solver/cpu"] = len(arrows)
        result[f"of these back up between {what}"] = len(back)
        details += [f"back up: {a} -> {b}" for a, b in back]

    result["calls of ChooseSolver"] = sum(
        len(re.findall(r"(?<!SolverChoice )\bChooseSolver\(", text)) for text in code.values())
    backend = re.search(r"class Backend \{.*?\n\};", code["server/solver/backend.h"], re.S).group()
    result["virtual methods of Backend"] = len(re.findall(r"\bvirtual (?!~)", backend))

    lengths, sequences = [], []
    for path in paths:
        if path.endswith(".proto"):
            continue
        for name, first, last, body in functions(path, read(path)):
            lengths.append((last - first + 1, name, f"{path}:{first}"))
            is_solver = path.startswith(("server/solver/", "shaders/"))
            calls_predict = re.search(r"Predict\w*\s*[(<]", body)
            calls_solve = re.search(r"\b(Solve|Sweep)\w*\s*\(", body)
            if is_solver and calls_predict and calls_solve:
                sequences.append(f"{name} ({path}:{first})")
    lengths.sort(reverse=True)
    result["functions"] = len(lengths)
    result[f"functions of more than {LONG} lines"] = len([n for n, _, _ in lengths if n > LONG])
    result["longest function, lines"] = lengths[0][0]
    details += [f"{length} lines: {name} ({place})" for length, name, place in lengths
                if length > LONG or lengths.index((length, name, place)) < 10]
    result["written sequences of the step"] = len(sequences)
    details += [f"sequence of the step: {sequence}" for sequence in sequences]

    long_lines, readmes = 0, []
    for path in tracked_files():
        if not path.endswith(".md"):
            continue
        lines = read(path).splitlines()
        long_lines += sum(len(line) > 120 and not line.lstrip().startswith("|") for line in lines)
        if os.path.basename(path) == "README.md" and "/results/" not in path:
            readmes.append((len(lines), path))
    readmes.sort(reverse=True)
    result["lines of Markdown over 120 columns outside tables"] = long_lines
    result["lines of README.md"] = len(read("README.md").splitlines())
    result["folder READMEs of more than 60 lines"] = sum(n > 60 for n, path in readmes if path != "README.md")
    result["longest README of a folder, lines"] = max(n for n, path in readmes if path != "README.md")
    return result, details


def main():
    result, details = counts()
    print(f"{'':60} {'before':>7} {'now':>7}")
    for name, count in result.items():
        print(f"{name:60} {BEFORE.get(name, '-'):>7} {count:>7}")
    print()
    for detail in details:
        print(detail)


if __name__ == "__main__":
    main()
