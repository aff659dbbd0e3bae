"""Requests without a transport.

A method that talks to the server is written once, as a generator: it yields `Unary` and `Reading` calls, is sent their
answers, and returns its result. `blocking` makes a method of it that waits; `drape.aio` makes a coroutine of the same
one.
"""

from __future__ import annotations

import functools
import inspect
from typing import Any, Callable, Generator, NamedTuple, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class Route(NamedTuple):
    """For whom a request is: a session, and the `incarnation` of the server that the caller knows it from; "": any.
    name_of: what errors call a cloth (`row_names`). is_closed: this program has closed the session."""

    session: str = ""
    incarnation: str = ""
    name_of: Callable[[int], str | None] | None = None
    is_closed: bool = False


class Unary(NamedTuple):
    """One request, or an iterable of them for a method that takes a stream; one answer, which the generator is sent."""

    method: str
    request: Any
    route: Route = Route()
    timeout_s: float | None = None


class Reading(NamedTuple):
    """One request, a stream of answers, each of which is given to `sink`. rest: the request for what has not come, when
    the stream was cut; None: all of it comes again, after `clear`."""

    method: str
    request: Any
    route: Route
    sink: Callable[[Any], None]
    timeout_s: float | None = None
    rest: Callable[[], Any] | None = None
    clear: Callable[[], None] | None = None


Operation = Generator[Any, Any, R]


def blocking(operation: Callable[P, Operation[R]]) -> Callable[P, R]:
    """The method of that name which waits for the server."""

    @functools.wraps(operation)
    def method(self, *args, **kwargs):
        return self._connection.run(operation(self, *args, **kwargs))

    return named(method, operation)  # type: ignore[return-value]


def with_more(docstring, more):
    """A docstring and a paragraph, which are indented alike only before Python 3.13."""
    return f"{inspect.cleandoc(docstring or '')}\n\n{inspect.cleandoc(more)}"


def named(method, operation):
    """`method` with the name and the signature that a user sees: without the underscore, with the result alone."""
    method.__name__ = operation.__name__.lstrip("_")
    method.__qualname__ = operation.__qualname__ = method.__name__  # also in Python's errors of arguments
    signature = inspect.signature(operation)
    result = str(signature.return_annotation)
    if result.startswith("Operation["):
        result = result[len("Operation["):-1]
    method.__signature__ = signature.replace(return_annotation=result)
    return method
