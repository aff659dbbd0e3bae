"""make_reference.py: writes reference.md from the docstrings of the package (tests/python compares them)."""

import inspect
import pathlib
import re
import textwrap

import drape
import drape.aio
import drape.gym

TARGET = pathlib.Path(__file__).with_name("reference.md")
HEAD = """# Reference of the Python package

Made by `make_reference.py` from the docstrings. Messages (`ClothSpec`, `StepSettings`, …) are those of
[the protocol](../../proto/drape/v1).
"""
FUNCTIONS = [drape.launch, drape.connect, drape.find_server, drape.scene.load, drape.scene.parse, drape.mesh.load,
             drape.mesh.from_arrays]
CLASSES = [drape.Client, drape.Session, drape.Cloths, drape.States, drape.Answer, drape.Impulses, drape.Pipeline,
           drape.Frames, drape.Frame, drape.Run,
           drape.scene.Scene, drape.scene.Player, drape.Retries, drape.Error, drape.SessionLost, drape.StateLost,
           drape.gym.ClothVectorEnv, drape.gym.DropFlat,
           drape.gym.FlingFlat, drape.gym.CoverSphere, drape.gym.FoldHalf, drape.gym.Flatten, drape.gym.Hang]


def text_of(thing):
    lines = []
    for line in inspect.cleandoc(thing.__doc__ or "").replace("<", "&lt;").splitlines():
        lines += textwrap.wrap(line, 120, break_long_words=False, break_on_hyphens=False) or [""]
    return "\n".join(lines)


def signature_of(function, name):
    text = f"{name}{inspect.signature(function)}"
    text = re.sub(r"<google[^>]*>|<drape[^>]*>", "POSITIONS", text)
    text = re.sub(r"positions: true\s*", "POSITIONS", text)
    text = re.sub(r"= Retries\([^)]*\)", "= Retries()", text)
    text = re.sub(r"Operation\[(.*)\]", r"\1", text)
    text = re.sub(r"(: |-> )'([^']*)'", r"\1\2", text)  # annotations are strings
    lines, line = [], ""
    for part in re.split(r"(?<=, )", text):
        if len(line) + len(part) > 110:
            lines.append(line.rstrip())
            line = "    "
        line += part
    return "```\n" + "\n".join([*lines, line]) + "\n```\n"


def members_of(cls):
    for name, member in inspect.getmembers(cls):
        if name.startswith("_") or name in dir(Exception) or not member.__doc__:
            continue
        if inspect.isfunction(member) and member.__module__.startswith("drape"):
            yield name, signature_of(member, name) + "\n" + text_of(member)
        elif isinstance(member, property) and getattr(member.fget, "__module__", "").startswith("drape"):
            yield name, f"```\n{name}\n```\n\n" + text_of(member)


def reference():
    parts = [HEAD, "## Functions\n"]
    for function in FUNCTIONS:
        name = f"{function.__module__}.{function.__name__}".replace("drape.client", "drape").replace(
            "drape.private_server", "drape")
        parts.append(f"{signature_of(function, name)}\n{text_of(function)}\n")
    for cls in CLASSES:
        parts.append(f"## {cls.__name__}\n\n{text_of(cls)}\n")
        parts += [text + "\n" for _, text in members_of(cls)]
    parts.append(f"## drape.aio\n\n{text_of(drape.aio)}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    TARGET.write_text(reference())
