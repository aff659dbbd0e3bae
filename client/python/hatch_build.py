"""Makes what the package needs of the protocol: its descriptors (messages are made from them when the package is
imported, so no generated code depends on one version of protobuf) and stubs for type checkers."""

import pathlib
import tempfile

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HEAD = '''"""The messages of the protocol `drape.v1`."""

from typing import NamedTuple

class Method(NamedTuple):
    path: str
    request: type
    answer: type
    streams_requests: bool
    streams_answers: bool

METHODS: dict[str, Method]
'''


class ProtocolHook(BuildHookInterface):
    def initialize(self, version, build_data):
        if self.target_name == "wheel":
            make_protocol(pathlib.Path(self.root))


def make_protocol(root):
    import grpc_tools
    from grpc_tools import protoc

    # A source distribution has its own copy of the protocol, a checkout the one of the server.
    protos = next(p for p in (root / "proto", root.parents[1] / "proto") if (p / "drape/v1").is_dir())
    files = sorted(str(p.relative_to(protos)) for p in (protos / "drape/v1").glob("*.proto"))
    out = root / "src/drape/v1"
    with tempfile.TemporaryDirectory() as scratch:
        status = protoc.main([
            "protoc", f"-I{protos}", f"-I{pathlib.Path(grpc_tools.__file__).parent / '_proto'}",
            f"--descriptor_set_out={scratch}/descriptors.binpb", f"--pyi_out={scratch}", *files])
        if status != 0:
            raise RuntimeError(f"protoc failed on {protos} with status {status}")
        for old in out.glob("*.pyi"):
            old.unlink()
        stubs = sorted(pathlib.Path(scratch, "drape/v1").glob("*.pyi"))
        for stub in stubs:
            (out / stub.name).write_text(stub.read_text())
        imports = "".join(f"from drape.v1.{stub.stem} import *\n" for stub in stubs)
        (out / "__init__.pyi").write_text(HEAD + imports)
        (out / "descriptors.binpb").write_bytes(pathlib.Path(scratch, "descriptors.binpb").read_bytes())


if __name__ == "__main__":
    make_protocol(pathlib.Path(__file__).resolve().parent)
