import pytest

from drape.viewer.pace import Pace

FRAME_S = 1 / 30


def begins(late_s):
    """When pictures begin whose sleep is each as much too long."""
    pace, now = Pace(FRAME_S), 100.0
    for late in late_s:
        yield now
        now += pace.left_s(now) + late


def test_sleeps_that_are_too_long_do_not_add_up():
    begun = list(begins([0.002] * 301))
    assert begun[300] - begun[0] == pytest.approx(300 * FRAME_S + 0.002)
    begun = list(begins([0.03, 0.001, 0.001] * 100 + [0]))  # nearly an interval
    assert begun[300] - begun[0] == pytest.approx(300 * FRAME_S + 0.001)


def test_a_long_pause_is_no_burst():
    begun = list(begins([0.0, 5.0, 0.0, 0.0, 0.0]))
    gaps = [after - before for before, after in zip(begun, begun[1:])]
    assert gaps == pytest.approx([FRAME_S, FRAME_S + 5, 0, FRAME_S])


def test_pictures_that_take_too_long_follow_each_other_at_once():
    pace = Pace(FRAME_S)
    assert [pace.left_s(now) for now in (10.0, 10.1, 10.2)] == pytest.approx([FRAME_S, 0, 0])
