import numpy as np
import pytest

import drape
from conftest import bits, sheet


def test_answers_come_in_order_and_have_the_same_bits(session, spec):
    cloths, alone = session.create(spec, count=2), session.create(spec, count=2)
    with cloths.pipeline(depth=3) as steps:
        answers = [steps.step() for _ in range(6)] + steps.drain()
    assert answers[:2] == [None, None]
    assert [int(answer.step_count[0]) for answer in answers[2:]] == [1, 2, 3, 4, 5, 6]
    for answer in answers[2:]:
        assert bits(answer.positions) == bits(alone.step().positions)
    assert np.array_equal(cloths.positions, alone.positions)


def test_controls_go_with_the_next_step(session, spec):
    cloths = session.create(spec)
    with cloths.pipeline() as steps:
        for k in range(1, 5):
            cloths.move_pins([0], [0, 0.01 * k, 0])
            answer = steps.step()
            if answer is not None:
                assert answer.positions[0, 0, 1] == np.float32(0.01 * (k - 1))
        assert steps.drain()[0].positions[0, 0, 1] == np.float32(0.04)


def test_an_error_ends_the_stream_and_the_batch_goes_on(session, spec):
    cloths = session.create(spec)
    with pytest.raises(drape.Error):
        with cloths.pipeline(depth=1) as steps:
            cloths.move_pins([7], [0, 0, 0])  # no pin
            steps.step()
    assert cloths.step().step_count == [1]
    with pytest.raises(drape.InvalidArgument, match="depth"):
        cloths.pipeline(0)


def test_a_step_of_no_cloths_has_its_place(session, spec):
    cloths = session.create(spec, count=2)
    with cloths.pipeline(depth=2) as steps:
        assert steps.step() is None
        assert steps.step(ids=[]).step_count.tolist() == [1, 1]
        assert steps.step(ids=[1]).positions.shape == (0, 36, 3)
        assert [answer.step_count.tolist() for answer in steps.drain()] == [[2]]
        assert steps.step(ids=np.zeros(2, bool)) is None and len(steps.drain()) == 1


def test_leaving_by_an_exception_cancels(session):
    cloths = session.create(sheet(64), count=4)
    with pytest.raises(KeyError):
        with cloths.pipeline(depth=8) as steps:
            for _ in range(6):
                steps.step(50)
            raise KeyError
    assert cloths.step().positions.shape == (4, 4096, 3)


@pytest.mark.parametrize("kind", ["as created", "elsewhere", "saved"])
def test_an_answer_is_that_of_its_step_also_when_the_next_one_starts_again(session, spec, kind):
    cloths, alone = session.create(spec, count=3), session.create(spec, count=3)
    for batch, name in ((cloths, "one"), (alone, "other")):
        batch.step()
        batch.save(name)
    transforms = [[0, 1, 0, 0, 0, 0, 1]]

    def again(batch, name):
        batch.restart([1], **{"as created": {}, "elsewhere": {"transforms": transforms}, "saved": {"to": name}}[kind])

    with cloths.pipeline(depth=4) as steps:
        found = []
        for k in range(12):
            if k % 2:
                again(cloths, "one")
            found.append(steps.step())
        found += steps.drain()
    for k, answer in enumerate(answer for answer in found if answer is not None):
        if k % 2:
            again(alone, "other")
        expected = alone.step()
        assert answer.step_count.tolist() == expected.step_count.tolist()
        assert bits(answer.positions) == bits(expected.positions)


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_step_after_the_end_says_why_there_is_none(session, spec, depth):
    cloths = session.create(spec)
    steps = cloths.pipeline(depth)
    steps.step()
    steps.close()
    cloths.move_pins([0], [0, 0.5, 0])
    for _ in range(2):
        with pytest.raises(drape.Cancelled, match="PIPELINE_CLOSED: the pipeline is closed"):
            steps.step()
    assert cloths.step().positions[0, 0, 1] == 0.5, "what waits for the next step still does"
    steps = cloths.pipeline(depth)
    cloths.move_pins([7], [0, 0, 0])  # no pin
    with pytest.raises(drape.InvalidArgument) as first:
        steps.step()
        steps.drain()
    for _ in range(2):
        with pytest.raises(drape.FailedPrecondition) as second:
            steps.step()
        assert second.value.reason == "PIPELINE_FAILED" and f"by {first.value}; open another" in second.value.message
    steps.close()
    with pytest.raises(drape.FailedPrecondition, match="PIPELINE_FAILED"):
        steps.step()
