"""What a type checker makes of a user's program."""

import subprocess
import sys

import pytest

PROGRAM = """
import drape

cloths = drape.launch().session().create(drape.ClothSpec(grid=drape.Grid(columns=3, rows=3)), count=2)
reveal_type(cloths)
reveal_type(cloths.step(2))
with cloths.pipeline() as steps:
    reveal_type(steps.step())
reveal_type(cloths.positions)
drape.Grid(colums=3)
cloths.step(stepz=3)
drape.connect(3)
"""
STRICT = """
from drape import Client, ClothSpec, Grid, launch


def made(client: Client) -> None:
    with client.session() as session:
        session.create(ClothSpec(grid=Grid(columns=3, rows=3)), count=2).step(2)


made(launch())
"""
EXPECTED = ['"drape.cloths.Cloths"', '"drape.states.Answer"', '"drape.states.Answer | None"', "numpy.ndarray",
            'Unexpected keyword argument "colums" for "Grid"; did you mean "columns"?',
            'Unexpected keyword argument "stepz"', 'Argument 1 to "connect" has incompatible type "int"; expected "str"']


@pytest.mark.full
def test_mypy_knows_results_and_finds_typing_errors(tmp_path):
    file = tmp_path / "program.py"
    file.write_text(PROGRAM)
    done = subprocess.run([sys.executable, "-m", "mypy", "--no-incremental", "--ignore-missing-imports", file],
                          capture_output=True, text=True, timeout=300, cwd=tmp_path)
    of_program = [line for line in done.stdout.splitlines() if line.startswith("program.py") and "note: \"" not in line]
    assert len(of_program) == len(EXPECTED), done.stdout + done.stderr
    for line, words in zip(of_program, EXPECTED):
        assert words in line


@pytest.mark.full
def test_a_strict_program_sees_what_the_package_exports(tmp_path):
    file = tmp_path / "program.py"
    file.write_text(STRICT)
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--no-incremental", "--follow-imports=silent", file],
                          capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
