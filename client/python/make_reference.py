"""make_reference.py: writes reference.md from the docstrings of the package (tests/python compares them)."""

import ast
import inspect
import pathlib
import re
import textwrap

import drape
import drape.aio
import drape.gym
from drape.gym import metrics, scripted

HERE = pathlib.Path(__file__).parent
TARGET = HERE / "reference.md"
_WIDTH = 120
HEAD = """# Reference of the Python package

Made by `make_reference.py` from the docstrings. Messages (`ClothSpec`, `StepSettings`, …) are those of
[the protocol](../../proto/drape/v1); `help(drape.ClothSpec)` has its comments.
"""


def functions_in(module):
    return [thing for _, thing in inspect.getmembers(module, inspect.isfunction)
            if thing.__module__ == module.__name__ and not thing.__name__.startswith("_")]


FUNCTIONS = [drape.launch, drape.connect, drape.find_server, drape.pack, drape.scene.load, drape.scene.parse, drape.mesh.load,
             drape.mesh.from_arrays]
ERRORS = [thing for _, thing in inspect.getmembers(drape.errors, inspect.isclass) if issubclass(thing, drape.Error)]
CLASSES = [drape.Client, drape.Session, drape.Cloths, drape.States, drape.Answer, drape.Grips, drape.Impulses, drape.Contacts,
           drape.Topology, drape.Pipeline, drape.Frames, drape.Frame, drape.Run,
           drape.scene.Scene, drape.scene.Player, drape.Retries, drape.VersionWarning, drape.Error, drape.FieldViolation,
           *(error for error in ERRORS if error is not drape.Error),
           drape.gym.ClothVectorEnv, drape.gym.DropFlat,
           drape.gym.FlingFlat, drape.gym.CoverSphere, drape.gym.FoldHalf, drape.gym.Flatten, drape.gym.Hang]
ENVIRONMENT = drape.gym.ClothVectorEnv  # what tasks have of it is said once, and how all of them are made
# Their modules need packages that are not always there: read, not imported.
READ = [("gym/sb3.py", "StableVecEnv"), ("gym/shards.py", "ShardedVectorEnv"), ("viewer/window.py", "Window")]
MODULES = [scripted, metrics]


def text_of(thing):
    return wrapped(inspect.cleandoc(thing.__doc__ or ""))


def wrapped(text):
    """Paragraphs whose lines are too long, filled anew; code, which is indented, and the others as they are."""
    parts = []
    for part in re.split(r"\n{2,}", text.replace("<", "&lt;")):
        is_code = any(line.startswith("    ") for line in part.splitlines())
        is_long = max(map(len, part.splitlines()), default=0) > _WIDTH
        parts.append(textwrap.fill(" ".join(part.split()), _WIDTH, break_long_words=False, break_on_hyphens=False)
                     if is_long and not is_code else part)
    return "\n\n".join(parts)


def signature_of(function, name):
    text = f"{name}{inspect.signature(function)}"
    text = re.sub(r"<google[^>]*>|<drape[^>]*>", "POSITIONS", text)
    text = re.sub(r"positions: true\s*", "POSITIONS", text)
    text = re.sub(r"<(AutoresetMode\.\w+)[^>]*>", r"\1", text)
    text = re.sub(r"= Retries\([^)]*\)", "= Retries()", text)
    text = re.sub(r"Operation\[(.*)\]", r"\1", text)
    text = re.sub(r"(: |-> )'([^']*)'", r"\1\2", text)  # annotations are strings
    return fenced(text)


def fenced(text):
    lines, line = [], ""
    for part in re.split(r"(?<=, )", text):
        if len(line) + len(part) > 110:
            lines.append(line.rstrip())
            line = "    "
        line += part
    return "```\n" + "\n".join([*lines, line]) + "\n```\n"


def read_class(path, name):
    """The parts of a class as its source says it: what has a docstring, and how it is made."""
    tree = ast.parse((HERE / "src/drape" / path).read_text())
    (found,) = [node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name]
    module = "drape." + path.removesuffix(".py").replace("/", ".")
    yield f"## {name}\n\nIn `{module}`.\n\n{wrapped(ast.get_docstring(found))}\n"
    members = sorted((node for node in found.body if isinstance(node, ast.FunctionDef)), key=lambda node: node.name)
    for node in members:
        is_made = node.name == "__init__"
        text = ast.get_docstring(node) or ""
        if (node.name.startswith("_") or not text) and not is_made:
            continue
        if any(isinstance(mark, ast.Name) and mark.id == "property" for mark in node.decorator_list):
            yield f"```\n{node.name}\n```\n\n{wrapped(text)}\n"
            continue
        result = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        arguments = ast.unparse(node.args)
        if is_made:
            arguments = arguments.removeprefix("self, ")
        yield f"{fenced(f'{name if is_made else node.name}({arguments}){result}')}" + (f"\n{wrapped(text)}\n" if text else "")


def members_of(cls):
    for name, member in inspect.getmembers(cls):
        if name.startswith("_") or name in dir(Exception) or not member.__doc__:
            continue
        if cls is not ENVIRONMENT and member is getattr(ENVIRONMENT, name, None):
            continue  # of a task
        if inspect.isfunction(member) and member.__module__.startswith("drape"):
            yield name, signature_of(member, name) + "\n" + text_of(member)
        elif isinstance(member, property) and getattr(member.fget, "__module__", "").startswith("drape"):
            yield name, f"```\n{name}\n```\n\n" + text_of(member)


def reference():
    parts = [HEAD, "## Functions\n"]
    for function in FUNCTIONS:
        name = f"{function.__module__}.{function.__name__}".replace("drape.client", "drape").replace(
            "drape.private_server", "drape").replace("drape.states", "drape")
        parts.append(f"{signature_of(function, name)}\n{text_of(function)}\n")
    for cls in CLASSES:
        parts.append(f"## {cls.__name__}\n\n{text_of(cls)}\n")
        if cls is ENVIRONMENT:
            parts.append(signature_of(cls.__init__, cls.__name__).replace("(self, ", "(") + "\nAlso of every task below.\n")
        elif issubclass(cls, ENVIRONMENT):
            parts.append("Arguments and members: those of `ClothVectorEnv`.\n")
        parts += [text + "\n" for _, text in members_of(cls)]
    for module in MODULES:
        parts.append(f"## {module.__name__}\n\n{text_of(module)}\n")
        parts += [f"{signature_of(function, function.__name__)}\n{text_of(function)}\n" for function in functions_in(module)]
    for path, name in READ:
        parts += read_class(path, name)
    parts.append(f"## drape.aio\n\n{text_of(drape.aio)}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    TARGET.write_text(reference())
