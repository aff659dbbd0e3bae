"""No growth of memory, however many steps."""

import os
import pathlib

import pytest

import drape
from conftest import sheet

_SETTLED = 300  # steps in which caches fill


def resident_bytes():
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("steps", [1500, pytest.param(10_000, marks=pytest.mark.full)])
def test_steps_leave_nothing_behind(session, steps):
    cloths = session.create(sheet(16, settings=drape.StepSettings(substeps=1)), count=16)  # 49 kB a step
    for _ in range(_SETTLED):
        cloths.step()
    before = resident_bytes()
    for k in range(steps):
        cloths.move_pins([0], [0, 0.001 * (k % 5), 0])
        cloths.step()
        if k % 10 == 0:
            cloths.read(velocities=True)
    # One step that is kept a time would be 74 to 490 MB.
    assert resident_bytes() - before < 8 << 20


def test_sessions_and_batches_leave_nothing_behind(client):
    for _ in range(30):
        _one_session(client)
    before = resident_bytes()
    for _ in range(150):
        _one_session(client)
    assert resident_bytes() - before < 8 << 20


def _one_session(client):
    with client.session() as session:
        session.create(sheet(), count=2).step()
