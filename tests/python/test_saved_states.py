"""Snapshots that are cut short, and what saved cloths become."""

import asyncio
import gc
import sys

import numpy as np
import pytest

import drape
import drape.aio
from conftest import bits


@pytest.fixture
def unraisable(monkeypatch):
    """What Python could not raise anywhere."""
    found = []
    monkeypatch.setattr(sys, "unraisablehook", found.append)
    yield found
    gc.collect()
    assert not found



def test_a_snapshot_that_is_interrupted_leaves_nothing_on_the_server(session, spec, monkeypatch, unraisable):
    cloths = session.create(spec)
    asked, plain = [], drape.connection.Connection._ask

    def ask(connection, of, call, tries):
        asked.append(call.method)
        if call.method == "ExportCloths":
            raise KeyboardInterrupt
        return plain(connection, of, call, tries)

    monkeypatch.setattr("drape.connection.Connection._ask", ask)
    with pytest.raises(KeyboardInterrupt):
        cloths.snapshot()
    assert asked == ["SaveStates", "ExportCloths", "DropStates"]


def test_a_snapshot_whose_task_is_cancelled_leaves_nothing_on_the_server(client, spec, unraisable):
    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(spec)
            asked, plain = [], other._connection._ask

            async def ask(of, call, tries):
                asked.append(call.method)
                if call.method == "ExportCloths":
                    task.cancel()
                    await asyncio.sleep(10)
                return await plain(of, call, tries)

            other._connection._ask = ask
            task = asyncio.create_task(cloths.snapshot())
            with pytest.raises(asyncio.CancelledError):
                await task
            assert asked == ["SaveStates", "ExportCloths", "DropStates"]
            other._connection._ask = plain
            return len(await cloths.snapshot())

    assert asyncio.run(program()) > 1000


def test_a_snapshot_of_a_loop_that_ends_asks_nothing_more(client, spec, unraisable):
    async def program():
        other = await drape.aio.connect(client.address)
        cloths = await (await other.session()).create(spec)
        running = cloths.snapshot()
        running.send(None)
        running.close()
        await other.close()

    asyncio.run(program())


def test_what_failed_first_is_raised(session, spec, monkeypatch):
    cloths = session.create(spec)

    def ask(connection, of, call, tries):
        raise drape.Unavailable(call.method)

    monkeypatch.setattr("drape.connection.Connection._ask", ask)
    with pytest.raises(drape.Unavailable, match="SaveStates"):
        cloths.snapshot()


def test_all_may_become_one(session, spec):
    cloths = session.create(spec, count=3)
    for row in range(3):
        cloths.move_pins([0], [0, 0.1 * row, 0], ids=[row])
    cloths.step(3)
    cloths.save("three")
    cloths.load("three", of=2)
    loaded = cloths.positions
    assert (bits(loaded[0]) == bits(loaded[1]) == bits(loaded[2])) and np.allclose(loaded[0, 0], [0, 0.2, 0])
    cloths.reset()
    cloths.load("three", [0, 1], of=-1)
    assert cloths.step_count.tolist() == [3, 3, 0] and bits(cloths.positions[:2]) == bits(loaded[:2])
    with pytest.raises(drape.InvalidArgument, match=r"of: has the shape \(2,\), which does not fit \(3,\)"):
        cloths.load("three", of=[0, 1])
