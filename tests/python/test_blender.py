"""What examples/blender_import.py shows in Blender is what the server computed, frame by frame."""

import subprocess

import numpy as np
import pytest

from conftest import DRAPE, ROOT

BLENDER = ROOT / "build/blender/bin/python"  # `./run test --full` makes it
EVERY = 3  # steps from sample to sample

# Runs where Blender's module is: the positions of all cloths at each of the frames, after the example has imported them.
SHOW = """
import os, runpy, sys, bpy, numpy as np
example, out, frames, *arguments = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
runpy.run_path(example)["main"](arguments)
if arguments[-1].startswith("--save="):
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(arguments[-1].removeprefix("--save=")))
shown = []
for frame in map(int, frames.split(",")):
    bpy.context.scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    points = []
    for cloth in sorted((one for one in bpy.context.scene.objects if one.type == "MESH"), key=lambda one: one.name):
        cloth = cloth.evaluated_get(graph)
        place = np.array(cloth.matrix_world)
        local = np.array([vertex.co for vertex in cloth.data.vertices])
        points.append(local @ place[:3, :3].T + place[:3, 3])
    shown.append(np.concatenate(points))
scene = bpy.context.scene
np.savez(out, shown=shown, first=scene.frame_start, last=scene.frame_end, fps=scene.render.fps / scene.render.fps_base)
"""


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blender")
    for flags in ([f"--every={EVERY}", "--states=s.usda", "--states=s.pc2", "--states=s.npz"], ["--states=s.obj"]):
        subprocess.run([DRAPE, "run", ROOT / "client/examples/sphere_drop.json", "--backend=cpu", "--duration=0.35",
                        "--quiet", *flags], check=True, cwd=folder)
    return folder


@pytest.mark.full
@pytest.mark.parametrize("arguments", [["s.usda"], ["s.usda", "--save=x.blend"], ["s.pc2", "--mesh=s.obj", "--fps=60"]])
def test_blender_shows_what_was_computed(played, arguments):
    states = np.load(played / "s.npz")
    steps, positions = states["steps"], states["positions"].astype(float)
    assert steps.tolist() == list(range(EVERY, 22, EVERY)) and positions.shape[1] == 2048  # two cloths, 21 steps
    frames = [int(steps[0]), int(steps[1]), int(steps[1]) + 1, int(steps[-1]) - 1, int(steps[-1])]
    subprocess.run([BLENDER, "-c", SHOW, ROOT / "client/python/examples/blender_import.py", "out.npz",
                    ",".join(map(str, frames)), *arguments], check=True, cwd=played, stdout=subprocess.DEVNULL)
    out = np.load(played / "out.npz")
    assert (out["first"], out["last"]) == (steps[0], steps[-1]) and np.isclose(out["fps"], 60)
    for frame, shown in zip(frames, out["shown"]):
        at = (frame - steps[0]) / EVERY
        low = int(at)
        expected = positions[low] + (at - low) * (positions[min(low + 1, len(steps) - 1)] - positions[low])
        expected = expected[:, [0, 2, 1]] * [1, -1, 1]  # z is up
        # Blender has single precision: a few roundings of coordinates and of the turn.
        assert np.abs(shown - expected).max() <= 8 * np.finfo(np.float32).eps * np.abs(expected).max(), frame
    assert np.abs(positions[-1] - positions[0]).max() > 0.01  # it moves


@pytest.mark.full
def test_a_mesh_of_another_scene_is_refused(played, tmp_path):
    other = tmp_path / "other.obj"
    other.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    done = subprocess.run([BLENDER, ROOT / "client/python/examples/blender_import.py", "s.pc2", f"--mesh={other}"],
                          cwd=played, capture_output=True, text=True)
    assert done.returncode != 0 and "2048 points" in done.stderr + done.stdout and "3 vertices" in done.stderr + done.stdout
