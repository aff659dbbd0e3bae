"""How answers show themselves in a notebook."""

import drape
from conftest import ROOT, sheet


def test_reprs_tell_types_and_shapes_in_one_line(session):
    cloths = session.create(sheet(32, max_grips=2), count=3)
    view = drape.StateView(positions=True, reductions=["COVERAGE"], coverage_radius_m=0.02)
    answer = cloths.step(2, view=view, report=True, impulses=True)
    assert repr(answer) == ("<Answer of 3 cloths at step 2: positions float32[3, 1024, 3], coverage float64[3], reports, grips, "
                            "impulses, 0 faulted>")
    assert repr(answer.grips) == ("<Grips: particles int64[3, 2], positions float64[3, 2, 3], impulses float64[3, 2, 3]>")
    assert repr(answer.impulses).startswith("<Impulses: colliders float64[3, 0, 3], ")
    assert repr(cloths.step(ids=[1], view=None)) == "<Answer of 1 cloths at step 3: 0 faulted>"
    assert repr(cloths.read(velocities=True)) == (
        "<States of 3 cloths at steps 2 to 3: positions float32[3, 1024, 3], velocities float32[3, 1024, 3]>")
    assert repr(cloths.step(ids=[])) == "<Answer of 0 cloths: positions float32[0, 1024, 3], 0 faulted>"
    assert repr(cloths.topology()) == (
        "<topology of 1024 particles (a grid of 32 x 32): 1922 triangles, 1984 edges, 0 meshes of colliders>")
    with cloths.frames() as frames:
        assert repr(next(frames)) == "<Frame of 3 cloths at steps 2 to 3: positions float32[3, 1024, 3]>"


def test_scenes_have_a_name_in_reprs(session):
    scene = drape.scene.load(ROOT / "client/examples/skirt.json")
    assert repr(scene) == "<scene 'skirt': 1 cloths, 180 steps of 0.01667 s>"
    assert repr(scene.play(session)) == f"<{scene!r} at step 0>"
