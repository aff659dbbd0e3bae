import numpy as np
import pytest

from drape import InvalidArgument, v1
from drape.columns import Pending, fill, rows_of, shaped, whole


def test_rows_of_takes_none_indices_and_masks():
    assert rows_of(None, 4) is None
    assert rows_of([2, 0], 4).tolist() == [2, 0]
    assert rows_of(3, 4).tolist() == [3]
    assert rows_of([-1], 4).tolist() == [3]
    assert rows_of(np.array([True, False, True, False]), 4).tolist() == [0, 2]


@pytest.mark.parametrize("nothing", [[], np.zeros(4, bool), np.array([], int)])
def test_nothing_selected_is_nothing(nothing):
    assert len(rows_of(nothing, 4)) == 0


@pytest.mark.parametrize("ids, words", [
    ([4], "index 4 is not one of the 4"),
    ([-5], "index -5"),
    ([1, 1], "twice"),
    (np.ones(3, bool), r"shape \(4,\), got \(3,\)"),
    ([0.5], "float64"),
    ([[0]], r"\(1, 1\)"),
])
def test_rows_of_names_what_is_wrong(ids, words):
    with pytest.raises(InvalidArgument, match=words) as caught:
        rows_of(ids, 4)
    assert caught.value.fields[0].field == "ids"


def test_fill_writes_what_extend_writes():
    rng = np.random.default_rng(1)
    ids, particles = rng.integers(0, 2**63, 300, dtype=np.uint64), rng.integers(0, 2**31, 300)
    targets = rng.normal(size=(300, 3))
    filled, extended = v1.PinControls(), v1.PinControls()
    fill(filled, {"cloth_ids": ids, "particles": particles, "targets_m": targets})
    extended.cloth_ids.extend(ids.tolist())
    extended.particles.extend(particles.tolist())
    extended.targets_m.extend(targets.ravel().tolist())
    assert filled == extended


def test_fill_takes_any_layout():
    message = v1.PinControls()
    fill(message, {"targets_m": np.arange(6, dtype=np.float32).reshape(2, 3).T})
    assert list(message.targets_m) == [0, 3, 1, 4, 2, 5]


def test_shapes_are_spread_or_refused():
    assert shaped("x", 2, (3, 2)).tolist() == [[2, 2]] * 3
    with pytest.raises(InvalidArgument, match=r"x: has the shape \(5,\), which does not fit \(3, 2\)"):
        shaped("x", np.zeros(5), (3, 2))
    with pytest.raises(InvalidArgument, match="not >= 0"):
        whole("x", [-1], (1,))
    with pytest.raises(InvalidArgument, match="float64"):
        whole("x", [0.5], (1,))


def test_pending_keeps_the_controls_of_other_cloths():
    ids = np.array([10, 11, 12], np.uint64)
    pending = Pending()
    pending.add("pin_controls", np.array([0, 1, 2]), {"particles": np.array([5, 6, 7]),
                                                       "targets_m": np.arange(9.0).reshape(3, 3)})
    first, rest, none = v1.StepRequest(), v1.StepRequest(), v1.StepRequest()
    pending.take(first, ids, np.array([1]), 3)
    assert list(first.pin_controls.cloth_ids) == [11]
    assert list(first.pin_controls.targets_m) == [3, 4, 5]
    pending.take(rest, ids, None, 3)
    assert list(rest.pin_controls.cloth_ids) == [10, 12]
    assert list(rest.pin_controls.particles) == [5, 7]
    pending.take(none, ids, None, 3)
    assert not none.HasField("pin_controls")


def test_what_is_put_back_comes_before_what_came_since_and_not_where_cloths_start_again():
    ids = np.array([10, 11], np.uint64)
    pending = Pending()
    pending.add("pin_controls", np.array([0, 1]), {"particles": np.array([5, 6])})
    taken = pending.take(v1.StepRequest(), ids, None, 2)
    pending.add("pin_controls", np.array([1]), {"particles": np.array([7])})
    pending.add_reset(np.array([0]), {})
    pending.put_back(taken)
    request = v1.StepRequest()
    pending.take(request, ids, None, 2)
    assert list(request.pin_controls.cloth_ids) == [11, 11] and list(request.pin_controls.particles) == [6, 7]
    assert list(request.resets.cloth_ids) == [10]
