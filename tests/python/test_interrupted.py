"""Ctrl-C while a program waits for a server that is not its own."""

import pathlib

import pytest

import drape
from conftest import run_python

# Interrupts itself in the middle of `asking`; prints whether that came out at once, and whether the session goes on.
BLOCKING = """
import os, signal, sys, threading, time, conftest, drape
client = drape.connect(sys.argv[1])
session = client.session()
cloths = session.create(conftest.sheet(32, settings=drape.StepSettings(substeps=1)), count=120)
cloths.step(1, view=None)

def pipelined():
    with cloths.pipeline(2) as steps:
        while True:
            steps.step(1000)

def interrupt():
    time.sleep(0.3)
    os.kill(os.getpid(), signal.SIGINT)

threading.Thread(target=interrupt).start()
begin = time.monotonic()
try:
    {asking}
except KeyboardInterrupt:
    took_s = time.monotonic() - begin
    before = cloths.read(particles=[0]).step_count
    after = cloths.step(1, view=None).step_count
    print(took_s < 5, (after > before).all(), session.lease_error, session.name)
    {ending}
"""
COROUTINES = """
import asyncio, os, signal, sys, threading, time, conftest, drape.aio

async def program():
    async with await drape.aio.connect(sys.argv[1]) as client, await client.session() as session:
        print(session.name, flush=True)
        cloths = await session.create(conftest.sheet(32), count=16)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            {asking}
        except asyncio.CancelledError:
            print((await cloths.step(1, view=None)).step_count.size)
            raise

try:
    asyncio.run(program())
except KeyboardInterrupt:
    print("interrupted")
"""
HERE = pathlib.Path(__file__).parent


@pytest.mark.parametrize("asking", [
    "cloths.step(1_000_000, view=None)", "cloths.step(1_000_000)",  # in one message; in chunks
    "cloths.rollout(1_000_000, view=drape.StateView(particles=[0]))", "pipelined()", "list(cloths.run())",
    "[frame for frame in cloths.frames()]", "session.step([cloths], 1_000_000)"])
@pytest.mark.parametrize("ending", ["client.close()", "pass"])
def test_ctrl_c_comes_out_at_once_and_the_session_goes_on(client, asking, ending):
    out = run_python(BLOCKING.format(asking=asking, ending=ending), client.address, cwd=HERE).split()
    assert out[:3] == ["True", "True", "None"]
    with pytest.raises(drape.SessionLost):  # it ended with its program
        client.session(name=out[3])


@pytest.mark.parametrize("asking", ["await cloths.step(1_000_000)", "[frame async for frame in cloths.frames()]"])
def test_ctrl_c_ends_coroutines(client, asking):
    name, *out = run_python(COROUTINES.format(asking=asking), client.address, cwd=HERE).split()
    assert out == ["16", "interrupted"]
    with pytest.raises(drape.SessionLost):
        client.session(name=name)
