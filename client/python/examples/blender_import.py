"""Brings a simulation of Drape into Blender: in Blender, or with its module (pip install bpy).

    drape run SCENE.json --states=FILE.usda                                  (or .pc2 and .obj)
    blender --python blender_import.py -- FILE.usda [--save OUT.blend]
    python blender_import.py FILE.pc2 --mesh FILE.obj --fps 60 [--save OUT.blend]

A frame of Blender is a step of the simulation, so the rate is that of the steps: what falls takes as long as it did.
USD has all that is needed (a mesh per cloth, the time). PC2 has points alone: the triangles of all cloths come from an
OBJ of the same scene, and the rate from --fps. Positions become Blender's: z is up, y is -z of Drape.
"""

import argparse
import pathlib
import struct
import sys

import bpy


def import_usd(path):
    """The objects of the cloths. Blender reads the positions of a frame when it shows it, so the file must stay."""
    bpy.ops.wm.usd_import(filepath=str(path), set_frame_range=True)
    cloths = [one for one in bpy.context.selected_objects if one.type in ("MESH", "CURVES", "POINTCLOUD")]
    _set_rate(_usd_rate(path))
    return cloths


def import_pc2(path, mesh, fps):
    """The object of all cloths. fps: steps per second. The file must stay."""
    # One mesh, its vertices in order: those of the cache.
    bpy.ops.wm.obj_import(filepath=str(mesh), forward_axis="NEGATIVE_Z", up_axis="Y", use_split_objects=False,
                          use_split_groups=False)
    cloths = bpy.context.selected_objects[0]
    points, start, sampling, samples = _pc2_header(path)
    if points != len(cloths.data.vertices):
        raise SystemExit(f"{path} has {points} points, {mesh} {len(cloths.data.vertices)} vertices: not the same scene")
    cache = cloths.modifiers.new("Drape", "MESH_CACHE")
    cache.cache_format = "PC2"
    cache.filepath = str(path)
    cache.interpolation = "LINEAR"  # between samples of `--every`
    cache.time_mode = "FRAME"
    # Blender leaves start and sampling of the file aside; its sample is frame * frame_scale - frame_start.
    cache.play_mode = "SCENE"
    cache.frame_scale = 1 / sampling
    cache.frame_start = start / sampling
    _set_rate(fps)
    bpy.context.scene.frame_start = int(start)
    bpy.context.scene.frame_end = int(start + sampling * (samples - 1))
    return [cloths]


def _pc2_header(path):
    with open(path, "rb") as file:
        magic, _, points, start, sampling, samples = struct.unpack("<12siiffi", file.read(32))
    if magic != b"POINTCACHE2\0":
        raise SystemExit(f"{path} is no PC2 file")
    return points, start, sampling, samples


def _usd_rate(path):
    bpy.utils.expose_bundled_modules()  # Blender 4.4 and later: pxr
    from pxr import Usd

    return Usd.Stage.Open(str(path)).GetTimeCodesPerSecond()


def _set_rate(fps):
    """Blender has whole frames per base."""
    render = bpy.context.scene.render
    render.fps = max(1, round(fps))
    render.fps_base = render.fps / fps


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cache", type=pathlib.Path)
    parser.add_argument("--mesh", type=pathlib.Path, help="with .pc2: an OBJ of the same scene")
    parser.add_argument("--fps", type=float, default=60, help="with .pc2: steps per second")
    parser.add_argument("--save", type=pathlib.Path, help="write a .blend file")
    flags = parser.parse_args(arguments)
    if flags.cache.suffix == ".pc2":
        if flags.mesh is None:
            parser.error("--mesh is needed with .pc2")
        cloths = import_pc2(flags.cache.resolve(), flags.mesh.resolve(), flags.fps)
    else:
        cloths = import_usd(flags.cache.resolve())
    print(f"imported {', '.join(sorted(cloth.name for cloth in cloths))}")
    if flags.save is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(flags.save.resolve()))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:])
