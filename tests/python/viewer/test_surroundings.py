import numpy as np
import pytest

import drape
from conftest import ROOT, sheet, wait_for
from drape import Environment
from drape.viewer import Window
from drape.viewer.surroundings import own

WIND = [6, 0, 0.3]


def values(cloths, name):
    return np.array([own(name, cloth) for cloth in cloths.descriptions()]).tolist()


def test_the_controls_begin_at_what_the_cloths_have(session, free_port):
    cloths = session.create(sheet(environment=Environment(gravity_m_per_s2=[0, -30, 1], wind_m_per_s=WIND)))
    with Window([cloths], port=free_port) as window:
        assert window.surroundings.gravity.value == -30 and window.surroundings.wind.value == (6, 0, 0.3)
        window.ask_step()
        wait_for(lambda: cloths.step_count[0] == 1)
    assert values(cloths, "gravity") == [[0, -30, 1]] and values(cloths, "wind") == [WIND]


def test_what_is_not_moved_stays(session, free_port):
    """Of the example: its wind, when gravity is moved."""
    flag = drape.scene.load(ROOT / "client/examples/flag.json")
    (cloths,) = flag.play(session).cloths
    with Window([cloths], port=free_port) as window:
        window.surroundings.gravity.value = 2.0
        wait_for(lambda: values(cloths, "gravity") == [[0, 2, 0]])
        assert values(cloths, "wind") == [WIND]
        assert list(cloths.spec.environment.gravity_m_per_s2) == [0, 2, 0]
        window.surroundings.wind.value = (6.0, 0.0, -1.0)
        wait_for(lambda: values(cloths, "wind") == [[6, 0, -1]])
        assert values(cloths, "gravity") == [[0, 2, 0]]


def test_each_cloth_keeps_components_of_its_own(session, free_port):
    one, other = session.create(sheet(), count=2), session.create(sheet(5))
    one.randomise(gravity=[[0, -1, 0], [3, -2, 0]], wind=[[1, 0, 0], [2, 0, 0]])
    with Window([one, other], port=free_port) as window:
        assert window.surroundings.gravity.value == -1
        window.surroundings.gravity.value = 5.0
        wait_for(lambda: values(other, "gravity") == [[0, 5, 0]])
        assert values(one, "gravity") == [[0, 5, 0], [3, 5, 0]]
        assert values(one, "wind") == [[1, 0, 0], [2, 0, 0]] and values(other, "wind") == [[0, 0, 0]]


def test_the_controls_follow_others_and_resets(session, free_port):
    scene = drape.scene.parse('{"duration_s": 1, "cloths": [{"spec": {"grid": '
                              '{"columns": 4, "rows": 4, "width_m": 1, "height_m": 1}}}], '
                              '"controls": [{"time_s": 0.1, "wind_m_per_s": [4, 0, 4.5]}]}')
    player = scene.play(session)
    with Window(player.cloths, advance=player.advance, reset=player.reset, port=free_port) as window:
        window.ask_step(12)
        wait_for(lambda: window.surroundings.wind.value == (4, 0, 4.5))
        window.ask_reset()
        wait_for(lambda: window.surroundings.wind.value == (0, 0, 0))
        assert values(player.cloths[0], "wind") == [[0, 0, 0]]


@pytest.mark.parametrize("name", ["gravity", "wind"])
def test_a_cloth_that_says_nothing_has_the_defaults(session, name):
    assert values(session.create(sheet()), name) == [[0, -9.81, 0] if name == "gravity" else [0, 0, 0]]
