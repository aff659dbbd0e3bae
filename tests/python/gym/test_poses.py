import numpy as np
import pytest

from conftest import sheet
from drape.gym import poses


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.9, 3.1])
def test_a_hanging_sheet_is_where_it_is_said_to_be(session, yaw):
    start = poses.hanging(0.3, 1.5, -0.2, yaw, 1.0)
    cloths = session.create(sheet(6), transforms=start[None])
    grid = cloths.positions[0].reshape(6, 6, 3)
    along, ahead = poses.row_direction(yaw), poses.forward_direction(yaw)
    assert np.allclose(grid[0].mean(0), [0.3, 1.5, -0.2], atol=1e-6)
    assert np.allclose(grid[0, 5] - grid[0, 0], along, atol=1e-6)
    assert np.allclose(grid[5, 0] - grid[0, 0], [0, -1, 0], atol=1e-6)
    assert np.allclose([along @ ahead, ahead[1], np.linalg.norm(ahead)], [0, 0, 1])
    assert np.allclose(np.cross(ahead, [0, 1, 0]), -along)  # right-handed: along x, up y, ahead z
    assert np.isclose(np.exp(1j * poses.yaw_of(start)), np.exp(1j * yaw))


def test_a_lying_sheet_begins_where_the_lowest_row_hung():
    start = poses.hanging(0, 0.5, 0, 0.4, 0.4)[None]
    flat = poses.lying(start, 3, 4, 0.4, 0.01)[0].reshape(3, 4, 3)
    assert np.allclose(flat[..., 1], 0.01)
    assert np.allclose(flat[2, 0], start[0, :3] * [1, 0, 1] + [0, 0.01, 0])
    assert np.allclose(flat[0] - flat[2], 0.4 * poses.forward_direction(0.4))
    assert np.allclose(flat[1, 3] - flat[1, 0], 0.4 * poses.row_direction(0.4))


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_a_sheet_on_the_floor_is_where_it_is_said_to_be(session, yaw):
    start = poses.on_floor(0.3, -0.2, yaw, 1.0, 0.05)
    flat = session.create(sheet(3, pins=[]), transforms=[start]).positions[0]
    assert np.allclose(flat[4], [0.3, 0.05, -0.2], atol=1e-6)  # the middle
    assert np.allclose(flat[2] - flat[0], poses.row_direction(yaw), atol=1e-6)
    assert np.allclose(flat[6] - flat[0], poses.forward_direction(yaw), atol=1e-6)
    assert np.isclose(poses.yaw_of(start), yaw)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_points_in_the_frame_of_the_start(yaw):
    starts = np.stack([poses.hanging(0.3, 0.6, -0.2, yaw, 0.4), poses.on_floor(0.3, -0.2, yaw, 0.4, 0.01)])
    points = np.array([0.3, 0, -0.2]) + [[0, 0, 0], poses.row_direction(yaw), poses.forward_direction(yaw), [0, 2, 0]]
    seen = poses.seen_from(starts, 0.4, np.stack([points, points]))
    expected = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 2, 0]])
    assert np.allclose(seen[0], expected)  # the middle of the first row is over (x, z)
    assert np.allclose(seen[1], expected + [0, 0, 0.2])  # and here half a sheet behind it
    turned = poses.turned(np.stack([points, points]), np.array([yaw, yaw]))
    assert np.allclose(poses.turned(turned, -np.array([yaw, yaw])), points)


def test_a_sheet_over_a_rail_has_its_lengths_and_keeps_to_the_rail():
    side, radius = 41, 0.03
    hung = poses.over_rail([0.1, -0.2], [False, True], side, 0.4, 0.5, radius).reshape(2, side, side, 3)
    along = np.linalg.norm(np.diff(hung, axis=1), axis=-1)
    step = 0.4 / (side - 1)
    # Around the rail the chord of an arc of a third of a radian is shorter than it by 1 - sin(x / 2) / (x / 2).
    assert along.max() <= step + 1e-12 and along.min() >= step * np.sin(step / radius / 2) / (step / radius / 2) - 1e-12
    assert np.allclose(np.linalg.norm(np.diff(hung, axis=2), axis=-1), step)
    apart = np.hypot(hung[..., 1] - 0.5, hung[..., 2])
    assert apart.min() > radius - 1e-12 and np.allclose(hung[:, side // 2, :, 1:], [0.5 + radius, 0])
    assert np.allclose(hung[0, 0, :, 2], radius) and np.allclose(hung[1, 0, :, 2], -radius)
    assert np.allclose(hung[0, 0, [0, -1], 0], [-0.1, 0.3]) and np.allclose(hung[1, 0, [0, -1], 0], [0.0, -0.4])
