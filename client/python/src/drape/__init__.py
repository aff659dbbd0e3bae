"""Client of the cloth-simulation server Drape: thousands of cloths as numpy arrays.

    import drape
    from drape import ClothSpec, Grid, Pin

    with drape.launch() as client, client.session() as session:
        spec = ClothSpec(grid=Grid(columns=32, rows=32, width_m=1, height_m=1),
                         pins=[Pin(particle=0), Pin(particle=31)])
        cloths = session.create(spec, count=64)
        cloths.step(60)
        print(cloths.positions.shape)         # (64, 1024, 3), metres

Descriptions are the messages of the protocol (proto/drape/v1); all of them are in `drape.v1`, those that a program makes
also here. A field that a new message cannot take is an InvalidArgument at once; what is assigned to a message later raises
protobuf's own TypeError, ValueError or AttributeError.
"""

from . import errors, mesh, scene, v1
from ._version import __version__
from .client import Client, VersionWarning, connect, launch
from .cloths import Cloths
from .errors import (Aborted, Cancelled, DeadlineExceeded, Error, FailedPrecondition, FieldViolation, ForkedProcess,
                     InvalidArgument, NotFound, ResourceExhausted, SessionLost, StateLost, Unauthenticated, Unavailable,
                     Unimplemented)
from .pipeline import Pipeline
from .private_server import find_server
from .retries import Retries
from .session import Session
from .states import POSITIONS, POSITIONS_AND_VELOCITIES, VELOCITIES, Answer, Contacts, Grips, Impulses, States, pack
from .streams import Frame, Frames, Run
from .topology import Topology
from .v1 import (BodyJoint, Box, Camera, Capsule, ClothOverride, ClothSpec, Collider, Cylinder, DistanceConstraint,
                 Environment, Grid, Material, Mesh, MeshImport, PackedArray, Particles, Pin, Plane, PointJoint,
                 RenderRequest, SelfCollision, Sphere, Spring, StateView, StepSettings, Transform)

# Written out, since type checkers read it: what it lacks is, to them, no part of the package.
__all__ = [
    "POSITIONS", "POSITIONS_AND_VELOCITIES", "VELOCITIES", "Aborted", "Answer", "BodyJoint", "Box", "Camera",
    "Cancelled", "Capsule", "Client", "ClothOverride", "ClothSpec", "Cloths", "Collider", "Contacts", "Cylinder",
    "DeadlineExceeded", "DistanceConstraint", "Environment", "Error", "FailedPrecondition", "FieldViolation",
    "ForkedProcess", "Frame", "Frames", "Grid", "Grips", "Impulses", "InvalidArgument", "Material", "Mesh",
    "MeshImport", "NotFound", "PackedArray", "Particles", "Pin", "Pipeline", "Plane", "PointJoint",
    "RenderRequest", "ResourceExhausted", "Retries", "Run", "SelfCollision", "Session", "SessionLost", "Sphere",
    "Spring", "StateLost", "StateView", "States", "StepSettings", "Topology", "Transform", "Unauthenticated",
    "Unavailable", "Unimplemented", "VersionWarning", "__version__", "connect", "errors", "find_server", "launch",
    "mesh", "pack", "scene", "v1"]
