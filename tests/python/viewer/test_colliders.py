"""What is drawn besides the surface is that of each row."""

import numpy as np
import pytest

from conftest import sheet, wait_for
from drape import BodyJoint, Box, ClothSpec, Collider, Environment, Pin, Plane, Sphere, Transform, mesh
from drape.viewer import Window

BALL = Collider(sphere=Sphere(center_m=[0.5, -2, 0.5], radius_m=0.2))
FLOOR = Collider(plane=Plane(point_m=[0, -3, 0], normal=[0, 1, 0]))
ORIGINS = [[0, 0, 0], [2, 0, 0], [4, 0, 0]]


@pytest.fixture
def cloths(session):
    return session.create(sheet(environment=Environment(colliders=[BALL, FLOOR])), count=3, origins=ORIGINS)


def at(window, index):
    """Row -> position of the collider of this index, as drawn."""
    found = {}
    for of, rows, handle in window._drawings[0]._colliders.places:
        if of == index:
            found.update({tuple(rows): np.round(handle.batched_positions, 5).tolist()})
    return found


def stepped(window, steps):
    window.ask_step(steps)
    before = int(window.batches[0].step_count[0])
    wait_for(lambda: f"step {before + steps}," in window.status.content)


def test_equal_colliders_are_one_mesh_and_a_plane_is_there_once(cloths, free_port):
    with Window([cloths], port=free_port) as window:
        assert at(window, 0) == {(0, 1, 2): [[0.5, -2, 0.5], [2.5, -2, 0.5], [4.5, -2, 0.5]]}
        assert at(window, 1) == {(0, 1, 2): [[0, -3, 0]]}


def test_each_row_has_its_own_pose(cloths, free_port):
    with Window([cloths], tracks_colliders=True, port=free_port) as window:
        cloths.move_colliders([0], [[[0.5, -1, 0.5]]], ids=[1])
        stepped(window, 2)
        assert at(window, 0) == {(0, 1, 2): [[0.5, -2, 0.5], [2.5, -1, 0.5], [4.5, -2, 0.5]]}
        cloths.move_colliders([1], [[[0, -2.5, 0]]], ids=[2])  # no longer the same floor
        stepped(window, 2)
        assert at(window, 1) == {(0, 1, 2): [[0, -3, 0], [4, -2.5, 0]]}


def test_each_row_has_its_own_colliders_and_pins(cloths, free_port):
    small = Collider(sphere=Sphere(center_m=[0.5, -2, 0.5], radius_m=0.1))
    cloths.update(ClothSpec(environment=Environment(colliders=[small])), ["environment.colliders"], ids=[1])
    cloths.update(ClothSpec(pins=[Pin(particle=35)]), ["pins"], ids=[2])
    with Window([cloths], port=free_port) as window:
        assert at(window, 0) == {(0, 2): [[0.5, -2, 0.5], [4.5, -2, 0.5]], (1,): [[2.5, -2, 0.5]]}
        assert at(window, 1) == {(0, 2): [[0, -3, 0]]}
        pins = window._drawings[0]._pins.points
        assert np.array_equal(pins, cloths.positions[[0, 0, 1, 1, 2], [0, 5, 0, 5, 35]])
        cloths.update(ClothSpec(), ["pins"], ids=[0])  # none
        window.ask_reset()
        wait_for(lambda: len(window._drawings[0]._pins.points) == 3)


def test_with_a_stride_they_are_those_of_the_rows_that_are_shown(cloths, free_port):
    cloths.move_colliders([0], [[[0.5, -1, 0.5]]], ids=[2])
    cloths.step()
    with Window([cloths], stride=2, port=free_port) as window:
        assert at(window, 0) == {(0, 1): [[0.5, -2, 0.5], [4.5, -1, 0.5]]}


def test_meshes_and_bodies(session, free_port):
    wedge = mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    still = Collider(mesh=wedge, transform=Transform(position_m=[0, -5, 0]), pivot_m=[0, 0, 0])
    falls = Collider(mesh=wedge, transform=Transform(position_m=[5, 0, 0]), mass_kg=1)
    cloths = session.create(sheet(environment=Environment(colliders=[still, falls])), count=2)
    with Window([cloths], port=free_port) as window:
        assert at(window, 0) == {(0, 1): [[0, 0, 0]]}
        assert at(window, 1) == {(0, 1): [[5.25, 0.25, 0.25]]}  # its centre of mass
        stepped(window, 3)
        (_, body) = cloths.describe(0).collider_poses
        ((place,),) = at(window, 1).values()
        assert np.allclose(place, body.position_m, atol=1e-5) and place[1] < 0.25 - 1e-3


def test_ropes_follow_their_bodies(session, free_port):
    """A ball on a rope of two parts over a pulley to a block that hangs on the other end, and falls."""
    ball = Collider(sphere=Sphere(center_m=[1, 3, 0], radius_m=0.1), mass_kg=1)
    ball.joints.append(BodyJoint(point_m=[1, 3.1, 0], collider=1, other_point_m=[2, 3.1, 0], rope_length_m=2.9,
                                 pulleys_m=[1, 4, 0, 2, 4, 0]))
    block = Collider(box=Box(center_m=[2, 3, 0], half_extents_m=[0.1, 0.1, 0.1]), mass_kg=3)
    cloths = session.create(sheet(environment=Environment(colliders=[ball, block])), count=2, origins=[[0, 0, 0], [5, 0, 0]])
    with Window([cloths], port=free_port) as window:
        ropes = window._drawings[0]._colliders._ropes
        way = np.array([[1, 3.1, 0], [1, 4, 0], [2, 4, 0], [2, 3.1, 0]])
        assert ropes.parts.shape == (6, 2, 3)
        assert ropes.parts[:3] == pytest.approx(np.stack([way[:-1], way[1:]], 1))
        assert ropes.parts[3:] == pytest.approx(ropes.parts[:3] + [5, 0, 0])
        stepped(window, 12)
        states = [pose.position_m[1] for pose in cloths.describe(1).collider_poses[:2]]
        assert states[1] < 2.97  # has slipped, and lifts nothing before its rope is taut
        assert ropes.parts[3, 0] == pytest.approx([6, states[0] + 0.1, 0], abs=1e-5)
        assert ropes.parts[5, 1] == pytest.approx([7, states[1] + 0.1, 0], abs=1e-5)
        assert np.array_equal(ropes._handle.points, ropes.parts)
        cloths.update(ClothSpec(), ["environment.colliders"])  # none
        stepped(window, 1)
        assert ropes.parts.shape == (0, 2, 3) and ropes._handle is None
