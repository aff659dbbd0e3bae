import numpy as np

import drape
from conftest import sheet
from drape.viewer import colours


def test_strain_is_the_largest_of_the_edges_of_a_particle(session):
    line = np.linspace(0, 1, 4)
    x, z = np.meshgrid(line, line)
    rest = np.stack([x, 0 * x, z], -1).reshape(1, -1, 3)
    paint, top = colours.StrainColours(session.create(sheet(4)).topology())(rest)
    assert (paint == paint[0, 0]).all()
    moved = rest.copy()
    moved[0, 15] += [0.05, 0, 0]  # a corner: its edge along x is 15 % too long
    paint, top = colours.StrainColours(session.create(sheet(4)).topology())(moved)
    assert np.isclose(top, 0.15)
    red = (paint[0, :, 0] > 170) & (paint[0, :, 2] < 50)
    assert np.flatnonzero(red).tolist() == [14, 15]


def test_a_mesh_has_the_edges_of_its_triangles(session):
    spec = drape.ClothSpec(mesh=drape.mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 0, 1.0]], [[0, 2, 1]]))
    strain = colours.StrainColours(session.create(spec).topology())
    order = np.lexsort(np.sort(strain.edges, axis=1).T[::-1])
    assert np.sort(strain.edges, axis=1)[order].tolist() == [[0, 1], [0, 2], [1, 2]]
    assert np.allclose(strain.lengths[order], [1, 1, np.sqrt(2)])


def test_speed_goes_from_dark_to_bright():
    paint, top = colours.by_speed(np.array([[[0, 0, 0], [0, 3, 4.0]]]))
    assert top == 5 and paint[0, 0].sum() < paint[0, 1].sum()
