import numpy as np
import pytest

from drape import Box, Capsule, Collider, Cylinder, Plane, Sphere, Transform, mesh
from drape.viewer.shapes import shape_of

TILT = [0.2, -0.5, 0.3, 0.8]
CASES = {
    "sphere": (Collider(sphere=Sphere(center_m=[1, 2, 3], radius_m=0.5)), 4 / 3 * np.pi * 0.125, [1, 2, 3]),
    "capsule": (Collider(capsule=Capsule(a_m=[0, 0, 0], b_m=[1, 1, 0], radius_m=0.2)),
                np.pi * 0.04 * np.sqrt(2) + 4 / 3 * np.pi * 0.008, [0.5, 0.5, 0]),
    "cylinder": (Collider(cylinder=Cylinder(a_m=[0, 0, 1], b_m=[0, -2, 1], radius_m=0.3)), np.pi * 0.09 * 2, [0, -1, 1]),
    "box": (Collider(box=Box(center_m=[1, 0, 0], half_extents_m=[0.1, 0.2, 0.3], rotation_xyzw=TILT)), 8 * 0.006, [1, 0, 0]),
    "mesh": (Collider(mesh=mesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        transform=Transform(position_m=[5, 0, 0], rotation_xyzw=TILT)), 1 / 6, [5, 0, 0]),
}


@pytest.mark.parametrize("name", CASES)
def test_solids_have_their_volume_and_face_outwards(name):
    collider, volume, pivot = CASES[name]
    vertices, faces, at = shape_of(collider)
    assert np.allclose(at, pivot)
    corners = vertices[faces].astype(float)
    enclosed = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    # 24 sections of a circle have 1.1 % less area than it, 12 of a half circle as much again.
    assert 0.96 * volume <= enclosed <= volume * 1.0001


def test_the_pivot_is_where_it_is_set_and_the_solid_stays():
    plain = Collider(sphere=Sphere(center_m=[1, 2, 3], radius_m=0.5))
    moved = Collider(sphere=Sphere(center_m=[1, 2, 3], radius_m=0.5), pivot_m=[0, 0, 1])
    (a, _, pivot_a), (b, _, pivot_b) = shape_of(plain), shape_of(moved)
    assert np.allclose(a + pivot_a, b + pivot_b, atol=1e-6) and pivot_b.tolist() == [0, 0, 1]


def test_a_plane_is_seen_from_its_outer_side():
    vertices, faces, _ = shape_of(Collider(plane=Plane(point_m=[0, 1, 0], normal=[1, 2, 0])))
    a, b, c = vertices[faces[0]]
    normal = np.cross(b - a, c - a)
    assert np.allclose(normal / np.linalg.norm(normal), np.array([1, 2, 0]) / np.sqrt(5), atol=1e-6)


def test_the_pivot_of_a_body_is_its_centre_of_mass():
    """As its poses are given, whatever the transform of its mesh."""
    collider = Collider(mass_kg=2)
    collider.MergeFrom(CASES["mesh"][0])
    vertices, _, pivot = shape_of(collider)
    assert np.allclose(vertices.mean(0), 0, atol=1e-6)  # of a tetrahedron
    plain, _, place = shape_of(CASES["mesh"][0])
    assert np.allclose(vertices + pivot, plain + place, atol=1e-6)
    cylinder = CASES["cylinder"][0]
    assert np.allclose(shape_of(Collider(cylinder=cylinder.cylinder, density_kg_per_m3=1))[2], [0, -1, 1])
