import asyncio
import sys
import threading
import time

import numpy as np
import pytest

import drape
import drape.aio
from conftest import bits, sheet


def test_every_frame_of_a_run_arrives(session, spec):
    cloths, alone = session.create(spec, count=2), session.create(spec)
    with cloths.frames(every_frame=True, velocities=True) as frames:
        assert next(frames).number == 1
        with cloths.run(hz=500, max_steps=20) as run:
            got = [next(frames) for _ in range(20)]
            reports = list(run)
    assert reports[0].steps == 0 and reports[-1].is_last and reports[-1].steps == 20
    for step, frame in enumerate(got, start=1):
        assert frame.rows.tolist() == [0, 1]
        assert frame.step_count.tolist() == [step, step]
        alone.step(view=drape.POSITIONS_AND_VELOCITIES)
        assert bits(frame.positions[0]) == bits(alone.positions[0])
        assert bits(frame.velocities[1]) == bits(alone.velocities[0])
        assert frame.dropped == 0


def test_the_latest_frame_wins(session, spec):
    cloths = session.create(spec)
    with cloths.frames() as frames:
        assert next(frames).step_count == [0]
        cloths.step(50)
        last = next(frames)
        while last.step_count[0] < 50:
            newer = next(frames)
            assert newer.step_count[0] > last.step_count[0]
            last = newer
        assert bits(last.positions) == bits(cloths.read().positions)


def test_a_run_pauses_and_ends_with_its_with(session, spec):
    cloths = session.create(spec)
    with cloths.run(hz=float("inf"), report_every_s=0.01) as run:
        while next(run).steps < 3:
            pass
        run.pause()
        assert next(report for report in run if report.is_paused)
        step = int(cloths.step().step_count[0])  # comes after what the run has under way
        assert cloths.read().step_count == [step]
        run.resume()
        assert next(report for report in run if report.lowest_step > step)
    # It may take a moment until the server knows.
    seen = [-1, int(cloths.read().step_count[0])]
    while seen[-1] != seen[-2]:
        seen.append(int(cloths.read().step_count[0]))


def test_refusals_are_errors_of_the_iteration(session, spec):
    cloths = session.create(spec)
    with pytest.raises(drape.FailedPrecondition) as mismatch, cloths.run(expected=3) as run:
        list(run)
    assert mismatch.value.reason == "STEP_MISMATCH" and mismatch.value.metadata["steps"] == "0"
    with pytest.raises(drape.InvalidArgument, match="max_hz"), cloths.frames(every_frame=True, max_hz=3) as frames:
        next(frames)
    with pytest.raises(drape.InvalidArgument, match="ids"):
        cloths.run(ids=[])


def opcodes_of(function):
    """How many instructions of Python a call takes: more each time something is done for nothing, on any machine. It is
    called twice: Python 3.13 counts from the next trace on."""
    count = 0

    def trace(frame, event, _):
        nonlocal count
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        count += event == "opcode"
        return trace

    before = sys.gettrace()
    for _ in range(2):
        count = 0
        sys.settrace(trace)
        try:
            function()
        finally:
            sys.settrace(before)
    return count


def test_a_frame_costs_as_much_as_it_has_cloths(session):
    costs = []
    for count in (100, 400):
        with session.create(sheet(2), count=count).frames() as frames:
            chunks = [frames._read()]
            costs.append(opcodes_of(lambda: frames._frame_of(chunks)))
    assert costs[1] < 4 * costs[0]


@pytest.mark.parametrize("leave", [
    lambda cloths: next(iter(cloths.frames())),
    lambda cloths: next(cloths.frames(every_frame=True)),
    lambda cloths: next(cloths.run()),
    lambda cloths: cloths.pipeline(depth=1).step(),
    lambda cloths: next(cloths.frames(every_frame=True, max_hz=3)),  # refused: the stream has ended
])
def test_threads_end_with_what_is_dropped(session, spec, leave):
    cloths = session.create(spec)
    before = set(threading.enumerate())
    for _ in range(3):
        try:
            leave(cloths)
        except drape.InvalidArgument:
            pass
    end = time.monotonic() + 20
    while not set(threading.enumerate()) <= before:
        assert time.monotonic() < end, threading.enumerate()
        time.sleep(0.01)


def test_a_thread_ends_with_its_stream_although_somebody_has_it(session, spec):
    before = set(threading.enumerate())
    refused = session.create(spec).frames(every_frame=True, max_hz=3)
    with pytest.raises(drape.InvalidArgument):
        next(refused)
    for thread in set(threading.enumerate()) - before:
        thread.join(20)
        assert not thread.is_alive()


def test_large_frames_come_in_chunks(session):
    cloths = session.create(sheet(330))  # 1.3 MB
    with cloths.frames(every_frame=True) as frames:
        assert next(frames).positions.shape == (1, 330 * 330, 3)
        cloths.step()
        frame = next(frames)
        assert frame.step_count == [1]
        assert bits(frame.positions) == bits(cloths.positions)


def test_with_asyncio():
    async def main():
        async with await drape.aio.launch("cpu", flags=["--threads=1"]) as client, await client.session() as session:
            cloths = await session.create(sheet(), count=2)
            async with cloths.frames(every_frame=True) as frames:
                assert (await anext(frames)).number == 1
                async with cloths.run(hz=500, report_every_s=0.01) as run:
                    for step in range(1, 11):
                        assert (await anext(frames)).step_count.tolist() == [step, step]
                    await run.pause()
                    async for report in run:
                        if report.is_paused:
                            break
                    await run.stop()
                    await run.pause()  # of what has ended: nothing
                    reports = [report async for report in run]
            assert reports[-1].is_last
            assert np.array_equal((await cloths.read()).step_count, [reports[-1].steps] * 2)

    asyncio.run(main())
