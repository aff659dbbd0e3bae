
import copy
import pathlib
import pickle
import re
import types

import pytest

import drape
from conftest import run_python
from drape import v1


def test_every_request_of_the_service_is_there():
    assert {"Step", "StepStream", "ReadStates", "CreateCloths"} <= set(v1.METHODS)
    step = v1.METHODS["StepStream"]
    assert step.path == "/drape.v1.SimulationService/StepStream" and step.streams_requests and step.streams_answers
    assert step.request is v1.StepRequest


def test_messages_are_the_protocols_own():
    assert drape.ClothSpec is v1.ClothSpec
    assert v1.Grid.DESCRIPTOR.file.name == "drape/v1/cloth_spec.proto"


WRONG = [
    (lambda: drape.Grid(columns="a"), "Grid.columns", "'a' is not a whole number in [0, 4294967295]"),
    (lambda: drape.Grid(width=1), "Grid.width", "Grid has no such field; did you mean width_m?"),
    (lambda: drape.Grid(shape=1), "Grid.shape", "Grid has no such field; it has columns, rows, width_m, height_m"),
    (lambda: drape.Material(friction_static="x"), "Material.friction_static", "'x' is not a number"),
    (lambda: drape.Pin(particle=-1), "Pin.particle", "-1 is not a whole number in [0, 4294967295]"),
    (lambda: drape.Sphere(center_m=1), "Sphere.center_m", "1 is not a list of numbers"),
    (lambda: drape.StepSettings(preset="FAST"), "StepSettings.preset", "'FAST' is not one of PAPER, REALTIME, ACCURATE"),
    (lambda: drape.Mesh(triangles=[[0, 1, 2]]), "Mesh.triangles", "[[0, 1, 2]] is not a PackedArray, as drape.pack makes"),
    (lambda: drape.ClothSpec(grid={"columns": "a"}), "ClothSpec.grid.columns", "'a' is not a whole number"),
    (lambda: drape.ClothSpec(pins=[{}, {"particl": 1}]), "ClothSpec.pins[1].particl", "did you mean particle?"),
    (lambda: drape.ClothSpec(pins=[3]), "ClothSpec.pins", "[3] is not a list of Pin messages"),
    (lambda: drape.Collider(plane=drape.Plane(), sphere=drape.Sphere()), "Collider.sphere", "only one of plane and sphere may"),
    (lambda: drape.ClothSpec(mesh=drape.Mesh(), grid=drape.Grid()), "ClothSpec.grid", "only one of mesh and grid may be given"),
    (lambda: drape.Environment(colliders=[{}, {"box": {}, "plane": {}}]), "Environment.colliders[1].plane", "only one of box and"),
    (lambda: drape.checks.message(v1.CreateClothsRequest, spec={"grid": {}, "mesh": {}}), "spec.mesh", "only one of grid and mesh"),
    (lambda: drape.checks.message(v1.StepRequest, steps=1, until_step=2), "until_step", "only one of steps and until_step may"),
    (lambda: v1.ImportClothsRequest.Begin(session=3), "Begin.session", "3 is not a text"),
]


@pytest.mark.parametrize("make, field, words", WRONG, ids=[field for _, field, _ in WRONG])
def test_a_field_that_a_new_message_cannot_take_is_named_with_what_is_legal(make, field, words):
    with pytest.raises(drape.InvalidArgument, match=re.escape(words)) as caught:
        make()
    assert caught.value.reason == "BAD_FIELD" and [named for named, _ in caught.value.fields] == [field]


def test_a_member_of_a_choice_that_is_none_is_not_given():
    assert drape.Collider(plane=None, sphere=drape.Sphere(radius_m=1)).WhichOneof("shape") == "sphere"


def test_messages_take_their_fields_by_name():
    with pytest.raises(drape.InvalidArgument, match="Grid takes its fields by name: columns, rows, width_m, height_m"):
        drape.Grid(3, 3)


def test_messages_are_copied_and_pickled():
    grid = drape.Grid(columns=2)
    assert copy.deepcopy(grid) == pickle.loads(pickle.dumps(grid)) == v1.Grid.FromString(grid.SerializeToString()) == grid


def test_what_a_program_describes_is_in_the_package():
    wanted, found = [drape.ClothSpec, v1.ClothOverride, v1.StateView, v1.RenderRequest], set()
    while wanted:
        kind = wanted.pop()
        if kind in found or kind.DESCRIPTOR.containing_type is not None:
            continue
        found.add(kind)
        wanted += [field.message_type._concrete_class for field in kind.DESCRIPTOR.fields if field.message_type is not None]
    assert {kind.DESCRIPTOR.name for kind in found} >= {"SelfCollision", "Camera", "PackedArray"}
    for kind in found:
        assert getattr(drape, kind.DESCRIPTOR.name) is kind


def test_the_package_exports_all_that_it_imports_by_name():
    modules = {name for name, value in vars(drape).items() if isinstance(value, types.ModuleType)}
    named = {name for name in vars(drape) if not name.startswith("_")} - modules
    assert set(drape.__all__) == named | {"__version__", "errors", "mesh", "scene", "v1"}


def test_messages_have_the_comments_of_the_protocol():
    """A wheel has no proto files."""
    assert drape.Grid.__doc__.startswith("A rectangle in the xz plane at y = 0 with its corner in the origin: particle index =")
    assert "\nmax_grips: int. Grips (StepRequest.grip_controls): 0 to 16." in drape.ClothSpec.__doc__
    assert "\npins: list of Pin\n" in drape.ClothSpec.__doc__
    assert "\nAt most one of grid, mesh, particles." in drape.ClothSpec.__doc__
    assert "\n    REALTIME: Many substeps with one iteration each. The default.\n" in drape.StepSettings.__doc__
    assert "view_direction: list of float. [3] from the eye into the picture" in drape.RenderRequest.Fit.__doc__
    for name in v1.__all__:
        kind = getattr(v1, name)
        assert all(f"{field}: " in kind.__doc__ for field in kind.DESCRIPTOR.fields_by_name), name
    stub = (pathlib.Path(v1.__file__).parent / "cloth_spec_pb2.pyi").read_text()
    assert '    """A rectangle in the xz plane' in stub and "\n    max_grips: int. Grips (StepRequest" in stub


def test_the_stubs_know_the_fields(tmp_path):
    """For type checkers: each message has a stub with its fields."""
    stubs = "".join(file.read_text() for file in pathlib.Path(v1.__file__).parent.glob("*_pb2.pyi"))
    for name in v1.__all__:
        assert f"class {name}(_message.Message):" in stubs


def test_the_protocol_may_be_loaded_twice():
    """Another package may have added the same files to protobuf's pool."""
    code = ("from google.protobuf import descriptor_pb2, descriptor_pool\nimport importlib.util, pathlib\n"
            "root = pathlib.Path(importlib.util.find_spec('drape').submodule_search_locations[0])\n"
            "files = descriptor_pb2.FileDescriptorSet.FromString((root / 'v1/descriptors.binpb').read_bytes())\n"
            "from google.protobuf import field_mask_pb2\n"
            "for file in files.file: descriptor_pool.Default().AddSerializedFile(file.SerializeToString())\n"
            "import drape; print(drape.Grid(columns=2).columns)")
    assert run_python(code).strip() == "2"
