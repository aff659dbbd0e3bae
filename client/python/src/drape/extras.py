"""Packages that only parts of this one need: what to install, in place of what Python says of a module that it lacks."""

from __future__ import annotations

import importlib.util


def need(module: str, extra: str) -> None:
    """Raises ModuleNotFoundError if `module` is not installed, with the extra of drape-sim that brings it."""
    if importlib.util.find_spec(module) is None:
        raise ModuleNotFoundError(f"no module named {module!r}: it comes with {of(extra)}", name=module)


def of(extra: str) -> str:
    """How to install an extra: by the wheels of `./run wheels`, or from the repository."""
    return (f"the extra {extra!r}: pip install --find-links build/wheels 'drape-sim[{extra}]', or pip install "
            f"'./client/python[{extra}]'")
