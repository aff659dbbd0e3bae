import numpy as np

import drape
from conftest import sheet


def test_a_grid_has_the_triangles_of_the_server(session):
    for columns, rows in ((2, 2), (5, 3), (1, 4), (4, 1)):
        spec = drape.ClothSpec(grid=drape.Grid(columns=columns, rows=rows, width_m=1, height_m=1))
        cloths = session.create(spec)
        triangles = cloths.triangles()
        assert len(triangles) == cloths.shape.triangles == 2 * (columns - 1) * (rows - 1)
        if len(triangles):
            corners = cloths.positions[0][triangles]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            assert (normals[:, 1] > 0).all()


def test_a_topology_is_that_of_the_cloth(session):
    cloths = session.create(sheet(3, transform=drape.Transform(position_m=[5, 0, 0])))
    found = cloths.topology()
    assert found.grid == (3, 3) and found.particles == 9
    assert np.allclose(found.rest_positions, [[x, 0, z] for z in (0, 0.5, 1) for x in (0, 0.5, 1)])
    assert {tuple(sorted(edge)) for edge in found.edges.tolist()} == {
        (a, b) for a in range(9) for b in range(9) if (b == a + 1 and b % 3) or b == a + 3}


def test_edges_have_the_order_and_names_of_rest_lengths(session):
    # Two pins beside each other: the edge between them is no constraint, and the others keep their index.
    columns, rows = 4, 3
    cloths = session.create(drape.ClothSpec(grid=drape.Grid(columns=columns, rows=rows, width_m=1, height_m=1),
                                            pins=[drape.Pin(particle=1), drape.Pin(particle=2)]))
    found = cloths.topology()
    edges = [(row * columns + k, row * columns + k + 1) for row in range(rows) for k in range(columns - 1)]
    edges += [(row * columns + k, (row + 1) * columns + k) for row in range(rows - 1) for k in range(columns)]
    wanted = {index: edge for index, edge in enumerate(edges) if edge != (1, 2)}
    assert found.constraints.tolist() == sorted(wanted)
    assert [tuple(sorted(edge)) for edge in found.edges.tolist()] == [wanted[index] for index in found.constraints.tolist()]
    # The one that a name drives is the one that changes.
    row = 6
    cloths.set_rest_lengths([int(found.constraints[row])], [[0.1]])
    cloths.step(300)
    a, b = found.edges[row]
    length = np.linalg.norm(cloths.positions[0][a] - cloths.positions[0][b])
    assert abs(length - 0.1) < 0.01


def test_meshes_of_colliders_are_told_to_who_attaches(client, session):
    tetrahedron = drape.mesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    ball = drape.Collider(sphere=drape.Sphere(center_m=[0, -9, 0], radius_m=0.1))
    session.create(sheet(environment=drape.Environment(colliders=[ball, drape.Collider(mesh=tetrahedron)])))
    with client.session(name=session.name) as other:
        found = other.attach().topology()
    assert list(found.collider_meshes) == [1] and found.grid == (6, 6)
    assert drape.states.unpack(found.collider_meshes[1].triangles).tolist() == [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
