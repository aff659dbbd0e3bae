import numpy as np

import drape
from conftest import sheet
from drape import topology


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


def test_edges_are_listed_once():
    edges = topology.edges_of(topology.triangles_of(sheet(3)))
    assert len(edges) == 6 + 6 + 4  # rows, columns, a diagonal per cell
    assert (edges[:, 0] < edges[:, 1]).all() and len(np.unique(edges, axis=0)) == len(edges)
