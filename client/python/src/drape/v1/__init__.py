"""The messages of the protocol `drape.v1`, made from its descriptors, with its comments: `help(drape.Grid)`.

`METHODS` are the requests of the service: name -> Method.
"""

import functools
import json
from importlib import resources
from typing import NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf import field_mask_pb2  # noqa: F401  the protocol imports it

from drape import checks


class Method(NamedTuple):
    path: str
    request: type
    answer: type
    streams_requests: bool
    streams_answers: bool


def _explain(cls, name, docs):
    """Gives a message its docstring, and errors that say what is wrong: fields that a new message cannot take are an
    InvalidArgument that names message, field and what is legal, in place of protobuf's TypeError or ValueError, which may
    name none of them; so are two members of one choice, of which protobuf would keep the last. What is assigned to a message
    later is protobuf's alone: it is read and written without Python."""
    for nested in cls.DESCRIPTOR.nested_types:
        _explain(getattr(cls, nested.name), f"{name}.{nested.name}", docs)  # getattr keeps the class, as it is then
    cls.__doc__ = docs[name]
    initialise = cls.__init__
    if hasattr(initialise, "__wrapped__"):
        return  # this module is loaded again
    place = f"{cls.DESCRIPTOR.name}."

    @functools.wraps(initialise)
    def explaining(self, *arguments, **fields):
        twice = checks.doubled(cls.DESCRIPTOR, fields, place)
        if twice is not None:
            raise twice
        try:
            initialise(self, *arguments, **fields)
        except (TypeError, ValueError) as error:
            raise checks.unfit(type(self), arguments, fields, place) or error from None

    cls.__init__ = explaining


def _load():
    files = descriptor_pb2.FileDescriptorSet.FromString(
        resources.files(__name__).joinpath("descriptors.binpb").read_bytes())
    pool = descriptor_pool.Default()
    for file in files.file:
        pool.AddSerializedFile(file.SerializeToString())
    docs = json.loads(resources.files(__name__).joinpath("docs.json").read_text(encoding="utf-8"))
    messages, methods = {}, {}
    for file in files.file:
        described = pool.FindFileByName(file.name)
        for name, message in described.message_types_by_name.items():
            messages[name] = message_factory.GetMessageClass(message)
            _explain(messages[name], name, docs)
        for service in file.service:
            for method in service.method:
                methods[method.name] = Method(
                    f"/{file.package}.{service.name}/{method.name}",
                    *(message_factory.GetMessageClass(pool.FindMessageTypeByName(name.lstrip(".")))
                      for name in (method.input_type, method.output_type)),
                    method.client_streaming, method.server_streaming)
    return messages, methods


_messages, METHODS = _load()
globals().update(_messages)
__all__ = sorted(_messages)
