"""Pickers and targets in pictures: where the server's picture has the places that they mark."""

import numpy as np
import pytest

from drape.gym import DropFlat, FlingFlat, Hang, marks


def count(picture, colour):
    return int((picture == np.array(colour, np.uint8)).all(-1).sum())


@pytest.fixture
def begun(client):
    made = []

    def begin(task):
        made.append(task(2, client=client, render_mode="rgb_array"))
        made[-1].reset(seed=1)
        return made[-1]

    yield begin
    for env in made:
        env.close()


def test_points_are_where_the_server_draws_them(begun):
    env = begun(DropFlat)
    _, depths = env.cloths.render_tiles(320, 240, env.camera, with_depths=True)
    column, row, distance = marks.projected(env.camera, env.cloths.positions, 320, 240)
    at = np.arange(2)[:, None], np.floor(row).astype(int), np.floor(column).astype(int)
    inner = np.abs(depths[at] - distance) < 0.02  # a border may miss the point of its pixel
    assert inner.mean() > 0.9 and np.median(np.abs(depths[at] - distance)) < 0.01


@pytest.mark.parametrize("task, has_target", [(DropFlat, True), (Hang, True), (FlingFlat, False)])
def test_pictures_show_pickers_and_targets(begun, task, has_target):
    env = begun(task)
    before = env.render()
    assert all(count(picture, marks.HOLDS) > 40 and count(picture, marks.OPEN) == 0 for picture in before)
    assert all((count(picture, marks.TARGET) > 50) == has_target for picture in before)
    opens = np.zeros((2, 8), np.float32)
    opens[0, 3:] = [1, 0, 0, 0, 1]  # only the first environment goes on holding
    env.step(opens)
    first, second = env.render()
    assert count(first, marks.HOLDS) > 40 and count(first, marks.OPEN) == 0
    assert count(second, marks.OPEN) > 40 and count(second, marks.HOLDS) == 0


def test_before_an_episode_and_what_is_hidden_or_outside(client, begun):
    env = DropFlat(1, client=client)
    assert not any(count(env.render()[0], colour) for colour in (marks.HOLDS, marks.OPEN, marks.TARGET))
    env.close()
    depths = np.full((1, 240, 320), 5.0, np.float32)
    places = np.array([[[0, 0.15, 0], [50, 0, 50], [1.7, 1.9, 2.4]]], float)  # in the middle, aside, behind the eye
    holds = np.ones((1, 3), bool)
    for depth, is_seen in ((5.0, True), (1.0, False)):
        pictures = np.zeros((1, 240, 320, 3), np.uint8)
        marks.draw(pictures, np.full_like(depths, depth), DropFlat.camera, places, holds, None)
        assert (pictures[0, 120, 160].tolist() == list(marks.HOLDS)) == is_seen
        assert (count(pictures[0], marks.HOLDS) > 0) == is_seen and count(pictures[0], marks.HOLDS) < 50
