"""No Python source uses a name that nothing defines: much of them runs in the full tier or in measurements alone."""

import re
import subprocess
import sys

import pytest

from conftest import ROOT

pytest.importorskip("mypy", reason="it is in build/venv: python_test runs this there")
# What mypy says of names with a dot is about modules that it does not follow.
UNDEFINED = re.compile(r'^(.*: error: Name "\w+" is not defined.*)$', re.MULTILINE)


def undefined(files, folder):
    """What mypy finds in `files`, paths in `folder`, also in functions without annotations."""
    done = subprocess.run([sys.executable, "-m", "mypy", "--ignore-missing-imports", "--follow-imports=skip", "--check-untyped-defs",
                           "--explicit-package-bases", "--namespace-packages", "--cache-dir=/dev/null", *files],
                          cwd=folder, capture_output=True, text=True)
    assert done.returncode in (0, 1) and "checked" in done.stdout, done.stderr + done.stdout[-500:]
    return UNDEFINED.findall(done.stdout)


def test_every_name_is_defined():
    files = sorted(str(path.relative_to(ROOT)) for folder in ("client", "docker", "tests")
                   for path in (ROOT / folder).rglob("*.py"))
    assert len(files) > 100
    assert not undefined(files, ROOT)


def test_a_name_that_is_not_defined_is_found(tmp_path):
    (tmp_path / "some.py").write_text("def asked():\n    def task():\n        return drape.launch()\n    return task\n")
    assert [words.partition(" error: ")[2] for words in undefined(["some.py"], tmp_path)] == [
        'Name "drape" is not defined  [name-defined]']
