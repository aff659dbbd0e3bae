import numpy as np
import pytest

from drape.gym import metrics

SIDE, SIZE = 32, 0.4
STAMP = np.sqrt(0.5) * SIZE / (SIDE - 1)


def flat(yaw=0.0, scale=1.0):
    line = np.linspace(-0.5, 0.5, SIDE) * SIZE * scale
    x, z = (axis.ravel() for axis in np.meshgrid(line, line))
    turned = np.stack([np.cos(yaw) * x + np.sin(yaw) * z, 0 * x, np.cos(yaw) * z - np.sin(yaw) * x], -1)
    return turned[None]


def by_squares(points, low, high, radius, cells):
    """The definition, square by square."""
    grid = np.zeros((cells, cells), bool)
    span = (high - low) / cells
    for point in points:
        a, b = (np.clip(np.rint((point - low + side) / span), 0, cells).astype(int) for side in (-radius, radius))
        grid[a[0]:b[0], a[1]:b[1]] = True
    return grid


def test_covered_cells_are_those_under_the_squares():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(5, 40, 2))
    low, high = points.min(1), points.max(1)
    fast = metrics.covered_cells(points, low, high, 0.2)
    for k in range(5):
        assert np.array_equal(fast[k], by_squares(points[k], low[k], high[k], 0.2, 100))


@pytest.mark.parametrize("yaw", [0, 0.3, np.pi / 4, 1.2])
def test_a_flat_sheet_covers_its_area_at_any_yaw(yaw):
    # The squares reach over the border by up to 1.42 times their half side: by at most 4 SIZE * 1.42 STAMP.
    area = metrics.coverage(flat(yaw), STAMP)[0]
    assert 0.99 * SIZE**2 <= area <= SIZE**2 + 4 * SIZE * 1.42 * STAMP


def test_a_folded_sheet_covers_half():
    folded = flat()
    folded[..., 0] = np.abs(folded[..., 0])
    assert metrics.coverage(folded, STAMP)[0] == pytest.approx(SIZE**2 / 2, rel=0.05)  # the box begins half a cell beside the fold


def test_covered_share_of_a_disc():
    assert metrics.covered_share(flat(), (0, 0), 0.08, STAMP)[0] == 1
    assert metrics.covered_share(flat() + [0.2 + STAMP, 0, 0], (0, 0), 0.08, STAMP)[0] == pytest.approx(0.5, abs=0.03)
    assert metrics.covered_share(flat() + [1, 0, 0], (0, 0), 0.08, STAMP)[0] == 0


def test_distances_and_shares():
    points = np.zeros((2, 3, 3))
    assert metrics.mean_distance(points, points + [3, 4, 0]).tolist() == [5, 5]
    assert metrics.normalized(np.array([-1.0, 0.0]), -2.0, 0.0).tolist() == [0.5, 1]
