"""Triangle meshes from files."""

from __future__ import annotations

import math
import os

import numpy as np

from . import checks, columns, errors, extras, states, v1


def load(path: str | os.PathLike, scale_m: float = 1.0) -> v1.Mesh:
    """The mesh of a file, its coordinates times `scale_m` [metres per unit of the file].

    Wavefront OBJ is read here: `v` and `f` of every object as one mesh, in double precision, vertices by position index
    alone, polygons split as fans. Other formats need trimesh (extra `mesh`).
    Raises NotFound without the file, InvalidArgument when it is no mesh (BAD_MESH_FILE) or `scale_m` is not > 0,
    FailedPrecondition where it cannot be read, Unimplemented without trimesh.
    """
    scale_m = checks.positive("scale_m", scale_m)
    checks.path("path", path)
    if not os.path.isfile(path):
        raise errors.NotFound(f"no mesh file {path}", reason="NO_MESH_FILE")
    try:
        vertices, triangles = _read_obj(path) if os.fspath(path).lower().endswith(".obj") else _read_other(path)
    except OSError as error:
        raise errors.FailedPrecondition(f"mesh file {path} cannot be read: {error}", reason="MESH_FILE_FAILED") from error
    return from_arrays(vertices * scale_m, triangles)


def from_arrays(vertices, triangles) -> v1.Mesh:
    """A mesh of vertices [m] [vertices, 3], finite, and triangles [triangles, 3], whole numbers from 0 to vertices - 1,
    counter-clockwise seen from outside. Raises InvalidArgument with the field, its value and what is legal."""
    vertices = _rows_of_three("vertices", vertices)
    if vertices.dtype != np.float32:
        vertices = vertices.astype(np.float64)
    if not np.isfinite(vertices).all():
        raise errors.bad_field("vertices", f"{vertices[~np.isfinite(vertices)][0]} is not finite")
    triangles = _rows_of_three("triangles", triangles)
    numbers = triangles.astype(np.float64)  # also of bools
    is_bad = (numbers != np.floor(numbers)) | (numbers < 0) | (numbers >= len(vertices))
    if is_bad.any():
        raise errors.bad_field("triangles", f"{triangles[is_bad][0]} is not a whole number in [0, {len(vertices) - 1}]")
    return v1.Mesh(positions_m=states.pack(vertices), triangles=states.pack(triangles.astype(np.uint32)))


def _rows_of_three(name, values):
    array = columns.numbers(name, values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise errors.bad_field(name, f"has the shape {array.shape}, (any number, 3) is needed")
    return array


def _bad(path, what):
    return errors.InvalidArgument(f"mesh file {path}: {what}", reason="BAD_MESH_FILE")


def _read_obj(path):
    vertices, triangles = [], []
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append(_vertex(path, number, words))
            elif words[0] == "f":
                corners = [_corner(path, number, word, len(vertices)) for word in words[1:]]
                triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
    if not triangles:
        raise _bad(path, "it has no faces")
    triangles = np.array(triangles)
    if triangles.max() >= len(vertices):  # OBJ allows a face before its vertices
        raise _bad(path, f"a face names vertex {triangles.max() + 1}, but there are {len(vertices)}")
    return np.array(vertices), triangles


def _vertex(path, number, words):
    try:
        vertex = [float(word) for word in words[1:4]]
    except ValueError:
        vertex = []
    if len(vertex) != 3 or not all(map(math.isfinite, vertex)):
        raise _bad(path, f"line {number}: a vertex needs three finite numbers, got {' '.join(words[1:4]) or 'none'}")
    return vertex


def _corner(path, number, word, so_far):
    try:
        index = int(word.split("/", 1)[0])
    except ValueError:
        index = 0
    at = index - 1 if index > 0 else so_far + index
    if index == 0 or at < 0:
        raise _bad(path, f"line {number}: a face names vertex {word}")
    return at


def _read_other(path):
    try:
        import trimesh
    except ImportError as error:
        raise errors.Unimplemented(f"{path}: only OBJ is read without trimesh, which comes with {extras.of('mesh')}",
                                   reason="NO_TRIMESH") from error
    try:
        loaded = trimesh.load(path, force="mesh", process=False)
    except OSError:
        raise
    except Exception as error:  # trimesh raises whatever the reader of the format does
        raise _bad(path, f"trimesh cannot read it: {type(error).__name__}: {error}") from error
    if len(getattr(loaded, "faces", ())) == 0:
        raise _bad(path, "it has no faces")
    return np.array(loaded.vertices), np.array(loaded.faces)
