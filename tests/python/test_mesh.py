import numpy as np
import pytest

import drape
from conftest import ROOT
from drape import mesh, states

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n"


def load(tmp_path, text, **options):
    file = tmp_path / "x.obj"
    file.write_text(text)
    found = mesh.load(file, **options)
    return states.unpack(found.positions_m), states.unpack(found.triangles)


def test_polygons_become_fans_in_double_precision(tmp_path):
    vertices, triangles = load(tmp_path, SQUARE + "vt 0 0\nf 1/1 4//2 3/1/1 2\n", scale_m=0.1)
    assert vertices.dtype == np.float64 and vertices[2].tolist() == [0.1, 0, 0.1]
    assert triangles.tolist() == [[0, 3, 2], [0, 2, 1]]


def test_negative_indices_count_from_the_last_vertex(tmp_path):
    _, triangles = load(tmp_path, SQUARE + "f -4 -1 -2\nv 5 5 5\n")
    assert triangles.tolist() == [[0, 3, 2]]


@pytest.mark.parametrize("text, words", [
    (SQUARE, "no faces"),
    (SQUARE + "f 1 2 9\n", "vertex 9, but there are 4"),
    (SQUARE + "f 1 2 x\n", "line 5: a face names vertex x"),
    (SQUARE + "f 0 1 2\n", "line 5"),
    ("v 1 nan 0\n", "line 1: a vertex needs three finite numbers"),
    ("v 1 2\n", "line 1"),
])
def test_bad_files_are_refused_by_line(tmp_path, text, words):
    with pytest.raises(drape.InvalidArgument, match=words) as caught:
        load(tmp_path, text)
    assert caught.value.reason == "BAD_MESH_FILE"


def test_a_missing_file(tmp_path):
    with pytest.raises(drape.NotFound):
        mesh.load(tmp_path / "none.obj")


def test_a_mesh_becomes_a_cloth(session):
    disc = mesh.load(ROOT / "client/examples/meshes/disc.obj")
    cloths = session.create(drape.ClothSpec(mesh=disc))
    assert cloths.particles == disc.positions_m.shape[0]
    assert np.allclose(cloths.positions[0], states.unpack(disc.positions_m), atol=1e-6)
    assert cloths.triangles().shape == (cloths.shape.triangles, 3)
