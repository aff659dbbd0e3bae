
import pathlib

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
    with pytest.raises(ValueError):
        drape.Grid(colums=3)


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
