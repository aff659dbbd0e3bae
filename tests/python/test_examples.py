import inspect
import json
import os
import pathlib
import re
import runpy
import subprocess
import sys

import pytest

from conftest import DRAPE, ROOT, run_python

EXAMPLES = ROOT / "client/python/examples"


def run(name, *arguments, **environment):
    done = subprocess.run([sys.executable, EXAMPLES / name, *arguments], capture_output=True, text=True, timeout=120,
                          env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_hello_says_what_the_cpp_example_says():
    out = run("hello.py")
    theirs = subprocess.run([pathlib.Path(DRAPE).with_name("hello_client")], capture_output=True, text=True, timeout=60)
    assert "1.0 s: the free corner is at" in out and "480 constraints" in out
    assert theirs.stdout.splitlines()[:10] == out.splitlines()[:10]


def test_random_policy():
    out = run("random_policy.py", "2", "1")
    assert "by hand: normalized performance 0.9" in out


def test_a_mesh_of_ones_own(tmp_path):
    out = run("own_mesh.py", ROOT / "client/examples/meshes/tube.obj", tmp_path / "tube.png")
    assert re.search(r"the grip is at \[.* 1\.8 .*\] m, and the cloth pulls it with 0\.\d+ N; crossings: 0", out)
    assert (tmp_path / "tube.png").read_bytes().startswith(b"\x89PNG")


def test_a_ball_in_a_hammock():
    out = run("ball_in_hammock.py", "0.15", "0.5")
    assert re.search(r"\nexchange at \d+ Hz: it gains at most 5%\n$", out), out


@pytest.mark.full
def test_shards_on_ray_go_on_when_a_server_is_killed():
    out = run("ray_shards.py", "6", "2", RAY_ADDRESS="local").splitlines()
    assert [line.split(" is on")[0] for line in out if " is on" in line] == ["shard 0", "shard 1"]
    actions = [line for line in out if line.startswith("action ")]
    assert [line.split(", ")[-1] for line in actions] == ["0 recoveries"] * 3 + ["1 recoveries"] * 3


def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    notebook = json.loads((EXAMPLES / "notebook.ipynb").read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert not any(cell.get("outputs") for cell in notebook["cells"])
    shown = tmp_path / "IPython/display.py"  # of a notebook: what it shows is kept in a file
    shown.parent.mkdir()
    (tmp_path / "IPython/__init__.py").touch()
    shown.write_text("Image = bytes\ndef display(picture): open('picture.png', 'wb').write(picture)\n")
    out = run_python("\n".join(cells), cwd=tmp_path)
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert "INVALID_FIELDS: spec.grid.columns" in out and "(16, 576, 3)" in out
    steps = out[out.index("steps [") + 7:out.index("]", out.index("steps ["))].split()
    assert len(steps) == 16 and set(steps) == {"0", "120"}, "the mask takes some cloths, not all"


def test_the_reference_is_that_of_the_docstrings():
    maker = ROOT / "client/python/make_reference.py"
    out = run_python(f"import runpy; print(runpy.run_path({str(maker)!r})['reference'](), end='')")
    assert out == (maker.parent / "reference.md").read_text(), f"{maker} writes it again"


# What cannot fail, or says so where it is made.
CANNOT_FAIL = {"close", "address", "lease_error", "name", "step_count", "time_step_s", "pause", "resume", "stop",
               "of_colliders", "of_cloth"}


def test_what_can_fail_says_what_it_raises():
    parts = runpy.run_path(str(ROOT / "client/python/make_reference.py"))
    members = {(cls.__name__, name): member for cls in parts["CLASSES"] if not cls.__module__.startswith("drape.gym")
               for name, member in inspect.getmembers(cls)
               if not name.startswith("_") and name not in dir(Exception)
               and (inspect.isfunction(member) or isinstance(member, property))}
    assert ("Cloths", "step") in members and ("Player", "advance") in members
    assert [key for key, member in members.items() if not member.__doc__] == []
    like_positions = {("Cloths", "velocities"), ("Cloths", "time_s")}
    told = {key: member.__doc__ for key, member in members.items() if key[1] not in CANNOT_FAIL and key not in like_positions}
    told.update({function.__name__: function.__doc__ for function in parts["FUNCTIONS"]})
    assert [key for key, text in told.items() if not re.search(r"\b[Rr]aises\b", text)] == []


def test_the_reference_has_everything_that_is_public():
    import drape
    import drape.gym
    from drape.gym import metrics, scripted

    text = (ROOT / "client/python/reference.md").read_text()
    for name in [*drape.__all__, *drape.gym.__all__]:
        thing = getattr(drape, name, None) or getattr(drape.gym, name)
        if inspect.isfunction(thing):
            assert f"drape.{name}(" in text, name
        elif inspect.isclass(thing) and (thing.__module__ or "").startswith("drape.") and not hasattr(thing, "DESCRIPTOR"):
            assert f"\n## {name}\n" in text, name
    for name in ("StableVecEnv", "ShardedVectorEnv", "Window"):
        assert f"\n## {name}\n" in text and f"\n{name}(" in text, name
    for module in (scripted, metrics):
        for name, function in inspect.getmembers(module, inspect.isfunction):
            assert function.__module__ != module.__name__ or name.startswith("_") or f"\n{name}(" in text, name
