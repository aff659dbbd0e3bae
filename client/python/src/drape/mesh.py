"""Triangle meshes from files."""

from __future__ import annotations

import math
import os

import numpy as np

from . import errors, extras, states, v1


def load(path: str | os.PathLike, scale_m: float = 1.0) -> v1.Mesh:
    """The mesh of a file, its coordinates times `scale_m` [metres per unit of the file].

    Wavefront OBJ is read here: `v` and `f` of every object as one mesh, in double precision, vertices by position index
    alone, polygons split as fans. Other formats need trimesh (extra `mesh`).
    Raises NotFound without the file, InvalidArgument when it is no mesh.
    """
    if not os.path.isfile(path):
        raise errors.NotFound(f"no mesh file {path}", reason="NO_MESH_FILE")
    if os.fspath(path).lower().endswith(".obj"):
        vertices, triangles = _read_obj(path)
    else:
        vertices, triangles = _read_other(path)
    return from_arrays(vertices * scale_m, triangles)


def from_arrays(vertices, triangles) -> v1.Mesh:
    """A mesh of vertices [m] [vertices, 3] and triangles [triangles, 3], counter-clockwise seen from outside."""
    vertices = np.asarray(vertices)
    if vertices.dtype != np.float32:
        vertices = vertices.astype(np.float64)
    return v1.Mesh(positions_m=states.pack(vertices), triangles=states.pack(np.asarray(triangles).astype(np.uint32)))


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
    loaded = trimesh.load(path, force="mesh", process=False)
    if len(loaded.faces) == 0:
        raise _bad(path, "it has no faces")
    return np.array(loaded.vertices), np.array(loaded.faces)
