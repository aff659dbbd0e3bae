"""Errors call cloths by the indices that the program knows them by, whatever their rows in the request were."""

import asyncio

import numpy as np
import pytest

import drape
import drape.aio
from conftest import sheet
from drape import ClothOverride

IDS = [3, 1, 2]  # of four: the second one is wrong
BAD = [0.0, np.nan, 0.0]
ONE_PLACE = np.array(BAD)[:, None, None]
START = [0, 0, 0, 0, 0, 0, 1.0]


def moved(cloths):
    cloths.move_pins([0], ONE_PLACE, ids=IDS)
    cloths.step()


def restarted(cloths):
    cloths.restart(IDS, transforms=[START, [np.nan] + START[1:], START])
    cloths.step(ids=IDS)


def driven(cloths):
    cloths.set_rest_lengths([[0, 1], [0, 999], [0, 1]], 0.1, ids=IDS)
    cloths.step()


def rolled_out(cloths):
    cloths.rollout(2, ids=IDS, pins=[0], pin_targets=np.broadcast_to(ONE_PLACE[:, None], (3, 2, 1, 3)))


def loaded(cloths):
    cloths.save("these", ids=[3, 2])
    cloths.load("these", ids=IDS)


def unlike(cloths):
    cloths.step(ids=[1])
    cloths.step(ids=IDS, expected=0)


def run_unlike(cloths):
    cloths.step(ids=[1])
    with cloths.run(expected=0, ids=IDS) as run:
        list(run)


def deleted(cloths):
    cloths._session.attach(cloths.ids[[1]]).delete()
    cloths.read(ids=IDS)


@pytest.mark.parametrize("ask", [
    lambda cloths: cloths.randomise(IDS, damping=[0, -1, 0]), lambda cloths: cloths.randomise(IDS, gravity=np.array(BAD)[:, None]),
    lambda cloths: cloths.reset(IDS, transforms=[START, [0.0] * 7, START]),
    lambda cloths: cloths.reset(IDS, overrides=[ClothOverride(), ClothOverride(damping_per_s=-1), ClothOverride()]),
    lambda cloths: cloths.write(np.array([0, 1e9, 0])[:, None, None] * np.arange(108).reshape(1, 36, 3) ** 2, ids=IDS),
    moved, restarted, driven, rolled_out, loaded, unlike, run_unlike, deleted])
def test_errors_name_the_cloth_that_the_program_named(session, ask):
    cloths = session.create(sheet(), count=4)
    with pytest.raises(drape.Error) as caught:
        ask(cloths)
    told = [description for _, description in caught.value.fields]
    assert "cloth 1 of the batch" in str(caught.value)
    assert all("cloth 1 of the batch" in description for description in told)
    assert str(cloths.ids[1]) not in str(caught.value)


def test_what_belongs_to_no_cloth_names_none(session):
    cloths = session.create(sheet(), count=4)
    for ask in (lambda: session.create(sheet(pins=[drape.Pin(particle=36)]), 4), lambda: cloths.read(particles=[1, 0, 36]),
                lambda: cloths.randomise(damping=-1, ids=[])):
        try:
            ask()
        except drape.InvalidArgument as error:
            assert "cloth" not in str(error)


def test_cloths_to_be_created_have_their_number(session):
    with pytest.raises(drape.InvalidArgument, match=r"environment_origins_m\[4\]: .* \(cloth 1\)"):
        session.create(sheet(), 2, origins=[[0, 0, 0], [0, np.nan, 0]])


def test_of_several_batches_the_batch_is_told(session):
    batches = [session.create(sheet(), 2) for _ in range(2)]
    batches[1].move_pins([0], ONE_PLACE[:2], ids=[0, 1])
    with pytest.raises(drape.InvalidArgument, match=r"\(cloth 1 of batches\[1\]\)"):
        session.step(batches)


def test_pipelines_of_coroutines_tell_it_too(client):
    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(sheet(), 4)
            async with cloths.pipeline(depth=3) as steps:
                await steps.step()
                cloths.move_pins([0], ONE_PLACE, ids=IDS)
                await steps.step()

    with pytest.raises(drape.InvalidArgument, match=r"\(cloth 1 of the batch\)"):
        asyncio.run(program())
