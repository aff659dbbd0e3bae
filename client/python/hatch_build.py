"""Makes what the package needs of the protocol: its descriptors (messages are made from them when the package is
imported, so no generated code depends on one version of protobuf), what its comments say, and stubs for type checkers."""

import json
import pathlib
import re
import tempfile
import textwrap

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
    places = [folder / "proto" for folder in (root, *root.parents[1:2])]
    protos = next((place for place in places if (place / "drape/v1").is_dir()), None)
    if protos is None:
        raise FileNotFoundError(f"the protocol is not in {' nor in '.join(map(str, places))}: client/python is installed from a "
                                "checkout of the whole repository")
    files = sorted(str(p.relative_to(protos)) for p in (protos / "drape/v1").glob("*.proto"))
    out = root / "src/drape/v1"
    with tempfile.TemporaryDirectory() as scratch:
        status = protoc.main([
            "protoc", "--include_source_info", f"-I{protos}", f"-I{pathlib.Path(grpc_tools.__file__).parent / '_proto'}",
            f"--descriptor_set_out={scratch}/descriptors.binpb", f"--pyi_out={scratch}", *files])
        if status != 0:
            raise RuntimeError(f"protoc failed on {protos} with status {status}")
        described = pathlib.Path(scratch, "descriptors.binpb").read_bytes()
        descriptors, docs = documented(described)
        for old in out.glob("*.pyi"):
            old.unlink()
        stubs = sorted(pathlib.Path(scratch, "drape/v1").glob("*.pyi"))
        for stub in stubs:
            (out / stub.name).write_text(with_docs(stub.read_text(), docs))
        imports = "".join(f"from drape.v1.{stub.stem} import *\n" for stub in stubs)
        (out / "__init__.pyi").write_text(HEAD + imports)
        (out / "descriptors.binpb").write_bytes(descriptors)
        (out / "docs.json").write_text(json.dumps(docs))


# --- what the comments say

# Numbers of fields in descriptor.proto: what a path of SourceCodeInfo goes through.
_MESSAGES, _FIELDS, _NESTED, _ENUMS, _VALUES = 4, 2, 3, 4, 2
_REPEATED = 3  # FieldDescriptorProto.LABEL_REPEATED
_KINDS = {"DOUBLE": "float", "FLOAT": "float", "BOOL": "bool", "STRING": "str", "BYTES": "bytes"}  # the others are whole


def documented(described):
    """The same descriptors without comments; and message ("Grid", "RenderRequest.Fit") -> its docstring."""
    from google.protobuf import descriptor_pb2

    files, docs = descriptor_pb2.FileDescriptorSet.FromString(described), {}
    for file in files.file:
        comments = {tuple(at.path): " ".join(at.leading_comments.split()) for at in file.source_code_info.location}
        for k, message in enumerate(file.message_type):
            _describe(message, message.name, (_MESSAGES, k), comments, docs)
        file.ClearField("source_code_info")
    return files.SerializeToString(), docs


def _describe(message, name, path, comments, docs):
    lines, enums = [comments.get(path, "")], {enum.name: (k, enum) for k, enum in enumerate(message.enum_type)}
    for k, field in enumerate(message.field):
        said = comments.get((*path, _FIELDS, k), "")
        lines.append(f"{field.name}: {_kind(field)}" + (f". {said}" if said else ""))
        kind = field.type_name.rpartition(".")[2]
        at, enum = enums.get(kind, (0, None))
        for v, value in enumerate(enum.value if enum is not None else ()):
            if value.number or not value.name.endswith("UNSPECIFIED"):
                of_value = comments.get((*path, _ENUMS, at, _VALUES, v), "")
                lines.append(f"    {value.name}" + (f": {of_value}" if of_value else ""))
    for k, oneof in enumerate(message.oneof_decl):
        names = [field.name for field in message.field
                 if field.HasField("oneof_index") and field.oneof_index == k and not field.proto3_optional]
        if names:
            lines.append(f"At most one of {', '.join(names)}.")
    docs[name] = "\n".join(textwrap.fill(line, 100, subsequent_indent=" " * 8, break_on_hyphens=False)
                           for line in lines[1:] if line)
    if lines[0]:
        docs[name] = f"{textwrap.fill(lines[0], 100, break_on_hyphens=False)}\n\n{docs[name]}".rstrip()
    for k, nested in enumerate(message.nested_type):
        _describe(nested, f"{name}.{nested.name}", (*path, _NESTED, k), comments, docs)


def _kind(field):
    word = field.Type.Name(field.type).removeprefix("TYPE_")
    one = field.type_name.rpartition(".")[2] if field.type_name else _KINDS.get(word, "int")
    return f"list of {one}" if field.label == _REPEATED else one


def with_docs(stub, docs):
    """A stub whose classes have these docstrings."""
    lines, owners = [], []
    for line in stub.splitlines():
        lines.append(line)
        found = re.match(r"( *)class (\w+)\(_message\.Message\):", line)
        if not found:
            continue
        depth = len(found[1]) // 4
        owners[depth:] = [found[2]]
        text = docs.get(".".join(owners), "").replace("\\", "\\\\")
        lines += [f'{found[1]}    {part}' for part in f'"""{text}\n"""'.splitlines()] if text else []
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    make_protocol(pathlib.Path(__file__).resolve().parent)
