"""The program `draped` in a wheel: `drape.launch()` finds it here."""

import os
import pathlib
import sys


def program() -> pathlib.Path:
    """The path of the server."""
    path = pathlib.Path(__file__).with_name("bin") / "draped"
    if not os.access(path, os.X_OK):  # some installers lose the mode
        path.chmod(0o755)
    return path


def main():
    """The command `draped`: becomes the server."""
    os.execv(program(), ["draped", *sys.argv[1:]])
