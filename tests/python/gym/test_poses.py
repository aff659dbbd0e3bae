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
