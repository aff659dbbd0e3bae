"""The package as `pip install ./client/python` puts it somewhere, a copy: it finds the server that was built beside it, or
says what to do."""

import os
import pathlib
import runpy
import subprocess
import sys

import pytest

from conftest import ROOT, run_python

HELLO = """
import drape, pathlib
assert pathlib.Path(drape.__file__).is_relative_to({folder!r}), drape.__file__
print(drape.find_server())
with drape.launch("cpu") as client, client.session() as session:
    print(session.create(drape.ClothSpec(grid=drape.Grid(columns=3, rows=3, width_m=1, height_m=1))).step().step_count)
"""


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A copy, so that nothing is written into this one; with the program that ctest tests."""
    root = tmp_path_factory.mktemp("checkout") / "drape with a space"
    root.mkdir()
    subprocess.run(["cp", "-r", "--parents", "client/python", "proto/drape", root], cwd=ROOT, check=True)
    (root / "LICENSE").write_bytes((ROOT / "LICENSE").read_bytes())
    return root


@pytest.fixture(scope="module")
def installed(checkout, tmp_path_factory):
    """Beside the packages that it needs: those of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps",
                    "--no-build-isolation", "--target", folder, checkout / "client/python"], check=True)
    return folder


def environment(installed, **more):
    kept = {name: value for name, value in os.environ.items() if name != "DRAPE_SERVER"}
    return {**kept, "PYTHONPATH": str(installed), "PATH": "/nowhere", **more}


def test_a_part_of_a_checkout_says_what_it_misses(tmp_path):
    hook = runpy.run_path(str(ROOT / "client/python/hatch_build.py"))
    alone = tmp_path / "client/python"
    for root in (alone, pathlib.Path("/")):
        with pytest.raises(FileNotFoundError, match="the protocol is not in .*proto.*: client/python is installed from a checkout"):
            hook["make_protocol"](root)


def test_a_copy_says_how_it_gets_a_server(installed, checkout):
    said = run_python("import drape\ntry: drape.launch()\nexcept drape.NotFound as error: print(error)",
                      env=environment(installed), cwd=installed)
    built = checkout / "build/release/bin/draped"
    assert said.startswith("NO_SERVER_PROGRAM") and f"{checkout}/run build, then set DRAPE_SERVER={built}" in said
    assert "pip install" in said and "drape-sim[server]" in said


def test_a_copy_runs_with_the_server_that_is_named_or_built_beside_it(installed, checkout):
    import drape

    program, code = drape.find_server(), HELLO.format(folder=str(installed))
    out = run_python(code, env=environment(installed, DRAPE_SERVER=program), cwd=installed)
    assert out.split() == [program, "[1]"]
    built = checkout / "build/release/bin/draped"
    built.parent.mkdir(parents=True)
    built.symlink_to(pathlib.Path(program).resolve())
    assert run_python(code, env=environment(installed), cwd=installed).splitlines() == [str(built), "[1]"]
