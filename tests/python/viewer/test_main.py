"""`python -m drape.viewer`: what it makes of scenes and sessions. Its flags: test_window.py."""

import numpy as np
import pytest

import drape
from conftest import ROOT, sheet, wait_for
from drape import ClothSpec, Grid
from drape.viewer import __main__ as program


def test_a_world_goes_on_after_the_end_of_its_scene(session, free_port, tmp_path):
    text = (ROOT / "client/examples/five_sheets.json").read_text().replace('"columns": 25, "rows": 25', '"columns": 6, "rows": 6')
    (tmp_path / "few.json").write_text(text.replace('"duration_s": 2', '"duration_s": 0.1'))
    with program._of_scene(session, tmp_path / "few.json", {"port": free_port}) as window:
        window.ask_step(4)
        wait_for(lambda: "step 4," in window.status.content)
        window.ask_step(4)  # the scene has 6
        wait_for(lambda: "step 8," in window.status.content)
        assert [int(cloths.step_count[0]) for cloths in window.batches] == [8] * 5


def test_a_world_of_unlike_sizes_is_stepped_from_here(client, session, free_port):
    for side in (6, 5):
        session.create(sheet(side, self_collision=drape.v1.SelfCollision()), world="pile")
    with client.session(name=session.name) as other, program._of_session(other, True, {"port": free_port}) as window:
        assert sorted(cloths.particles for cloths in window.batches) == [25, 36]
        window.ask_step(3)
        wait_for(lambda: "step 3," in window.status.content)
        assert [int(cloths.step_count[0]) for cloths in window.batches] == [3, 3]


@pytest.mark.parametrize("sizes", [((8, 8), (4, 16)), ((4, 16), (16, 4))])
def test_cloths_of_unlike_topology_are_batches_of_their_own(client, session, free_port, sizes):
    made = [session.create(ClothSpec(grid=Grid(columns=columns, rows=rows, width_m=1, height_m=1)), count=2)
            for columns, rows in sizes]
    with client.session(name=session.name) as other, program._of_session(other, False, {"port": free_port}) as window:
        assert [cloths.ids.tolist() for cloths in window.batches] == [cloths.ids.tolist() for cloths in made]
        for cloths, drawing in zip(made, window._drawings):
            assert np.array_equal(drawing._topology.triangles, cloths.triangles())


def test_a_session_without_cloths_is_said(session):
    with pytest.raises(drape.FailedPrecondition) as caught:
        program._of_session(session, False, {})
    assert caught.value.reason == "NO_CLOTHS"
