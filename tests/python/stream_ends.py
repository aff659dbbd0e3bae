"""How streams end, at whatever is between a client and its server. gRPC resets a stream that ends while its client could
still send; what HAProxy makes of that must take neither answers nor reasons."""

import asyncio
import subprocess
import time

import pytest

import drape
import drape.aio
from conftest import DRAPE, sheet

BAD_STEPS = 10**9


def all_ends_are_told(address):
    with drape.connect(address) as client, client.session() as session:
        cloths, gone = session.create(sheet(), 2), session.create(sheet())
        _runs_are_told(cloths)
        _pipelines_are_told(cloths)
        gone.delete()
        for stream in (gone.run(60), gone.frames(), gone.frames(every_frame=True)):
            with pytest.raises(drape.NotFound) as caught:
                next(stream)
            assert caught.value.reason == "CLOTH_NOT_FOUND"
        _frames_are_told(session)
        _imports_are_told(client)
        asyncio.run(_awaited_ends_are_told(address, session.name))
        _the_command_line_is_told(address, session.name)


def _runs_are_told(cloths):
    for _ in range(3):
        assert [report.steps for report in cloths.run(1000, max_steps=30)][-1] == 30
    # One who reads so late that the end has long come.
    last = None
    for last in cloths.run(float("inf"), max_steps=200, report_every_s=0.01):
        time.sleep(0.2)
    assert last.is_last and last.steps == 200


def _pipelines_are_told(cloths):
    before = int(cloths.read().step_count[0])
    with cloths.pipeline(depth=8) as pipeline:
        for steps in (1, 2, 3, BAD_STEPS):
            assert pipeline.step(steps) is None
        time.sleep(0.2)
        told = []
        with pytest.raises(drape.InvalidArgument) as caught:
            for answer in pipeline._rest():
                told.append(int(answer.step_count[0]) - before)
    assert told == [1, 3, 6]
    assert caught.value.reason == "INVALID_FIELDS"


def _frames_are_told(session):
    """Frames that wait when the stream ends come first."""
    cloths = session.create(sheet())
    with cloths.frames(every_frame=True, queue_frames=64) as frames:
        seen = [int(next(frames).step_count[0])]
        cloths.step(3)
        cloths.delete()
        with pytest.raises(drape.NotFound) as caught:
            while True:
                time.sleep(0.1)
                seen.append(int(next(frames).step_count[0]))
    assert seen == [0, 1, 2, 3]
    assert caught.value.reason == "CLOTH_NOT_FOUND"


def _imports_are_told(client):
    """Refused by its first message, while the others are sent."""
    with client.session() as session:
        name = session.name
        there = client.session(name=name)
    with pytest.raises(drape.SessionLost):
        there.restore(bytes(32 << 20))


async def _awaited_ends_are_told(address, name):
    async with await drape.aio.connect(address) as client:
        session = await client.session(name=name)
        cloths = await session.create(sheet())
        reports = [report async for report in cloths.run(1000, max_steps=30)]
        assert reports[-1].steps == 30
        async with cloths.pipeline(depth=8) as pipeline:
            await pipeline.step()
            await pipeline.step(BAD_STEPS)
            with pytest.raises(drape.InvalidArgument):
                await pipeline.drain()
        await cloths.delete()
        for stream in (cloths.run(60), cloths.frames()):
            with pytest.raises(drape.NotFound) as caught:
                await anext(stream)
            assert caught.value.reason == "CLOTH_NOT_FOUND"


def _the_command_line_is_told(address, name):
    """The C++ client."""
    step = lambda *words: subprocess.run([DRAPE, "step", f"--server={address}", f"--session={name}", "--hz=1000", *words],
                                         capture_output=True, text=True, timeout=60)
    done = step("--steps=30")
    assert done.returncode == 0 and " 30 steps, 0 behind" in done.stdout, done.stderr
    refused = step("--cloth=12345")
    assert refused.returncode == 1 and "CLOTH_NOT_FOUND" in refused.stderr
