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
    with pytest.raises(drape.InvalidArgument, match="path: 3 is not the path of a file"):
        mesh.load(3)


@pytest.mark.parametrize("scale_m", [0, -1, np.nan, np.inf, "2 cm", None])
def test_a_scale_is_a_length(tmp_path, scale_m):
    with pytest.raises(drape.InvalidArgument, match=f"scale_m: {scale_m!r} is not a finite number > 0"):
        load(tmp_path, SQUARE + "f 1 2 3\n", scale_m=scale_m)


@pytest.mark.parametrize("name, text", [("x.ply", "no ply"), ("x.stl", "solid\nfacet x"), ("x.nothing", "x"),
                                        ("x.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                                                  "property float z\nend_header\n0 0 0\n")])
def test_what_trimesh_cannot_read_is_a_bad_file(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(drape.InvalidArgument, match=f"mesh file .*{name}: ") as caught:
        mesh.load(tmp_path / name)
    assert caught.value.reason == "BAD_MESH_FILE"


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize("vertices, triangles, words", [
    (CORNERS, [[0, 2, 1.9]], r"triangles: 1.9 is not a whole number in \[0, 2\]"),
    (CORNERS, [[0, 2, -1]], r"triangles: -1 is not a whole number in \[0, 2\]"),
    (CORNERS, [[0, 2, 3]], r"triangles: 3 is not a whole number in \[0, 2\]"),
    (CORNERS, [[0, 2, np.nan]], "triangles: nan is not"),
    (CORNERS, [[0, 2, 1], [0]], "triangles: numbers are needed, in lists of equal lengths"),
    (CORNERS, [0, 2, 1], r"triangles: has the shape \(3,\), \(any number, 3\) is needed"),
    (CORNERS[0], [[0, 2, 1]], r"vertices: has the shape \(3,\)"),
    ("abc", [[0, 2, 1]], "vertices: numbers are needed"),
    ([[0, 0, np.inf], *CORNERS[1:]], [[0, 2, 1]], "vertices: inf is not finite")])
def test_arrays_that_are_no_mesh_are_refused(vertices, triangles, words):
    with pytest.raises(drape.InvalidArgument, match=words):
        mesh.from_arrays(vertices, triangles)


def test_arrays_become_a_mesh():
    found = mesh.from_arrays(np.array(CORNERS, np.float32), [[0.0, 2.0, 1.0]])
    assert states.unpack(found.positions_m).dtype == np.float32
    assert states.unpack(found.triangles).tolist() == [[0, 2, 1]]


def test_a_mesh_becomes_a_cloth(session):
    disc = mesh.load(ROOT / "client/examples/meshes/disc.obj")
    cloths = session.create(drape.ClothSpec(mesh=disc))
    assert cloths.particles == disc.positions_m.shape[0]
    assert np.allclose(cloths.positions[0], states.unpack(disc.positions_m), atol=1e-6)
    assert cloths.triangles().shape == (cloths.shape.triangles, 3)
