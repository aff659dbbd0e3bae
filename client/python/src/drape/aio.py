"""The same names for asyncio, after `import drape.aio`: every method that asks the server is a coroutine.

    async with await drape.aio.launch() as client, await client.session() as session:
        cloths = await session.create(spec, count=64)
        answer = await cloths.step(60)

The properties `positions`, `velocities` and `time_s` of a batch do not ask: they have what the last step of all cloths, or
read, brought, and raise FailedPrecondition (NOT_READ) where it did not bring them; `await cloths.read(velocities=True)`
brings all three. `cloths.grip(particles=…)` without `at` needs `positions`: after `create`, `reset`, `restart` and a step
with another view comes `await cloths.read()`.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import weakref
from typing import Awaitable, Callable

import grpc
import grpc.aio

from . import errors, states, v1
from .client import ClientBase
from .cloths import ClothsBase
from .connection import REQUEST_TIMEOUT_S, ConnectionBase, channel_options, credentials, iter_of_many
from .operations import Operation, P, R, Route, Unary, named
from .pipeline import PipelineBase
from .private_server import PrivateServer
from .retries import Retries
from .rollout import awaited_rollout
from .session import _LAST_CALL_S, _RENEWALS_PER_LEASE, SessionBase, iter_of
from .streams import Frame, FramesBase, RunBase


def _is_cancelled():
    """Whether somebody wants this task to end; before Python 3.11 nobody knows. What gRPC raises of a call that was cancelled
    is the same."""
    return getattr(asyncio.current_task(), "cancelling", int)() > 0


def _awaiting(operation: Callable[P, Operation[R]]) -> Callable[P, Awaitable[R]]:
    @functools.wraps(operation)
    def method(self, *args, **kwargs):
        return self._connection.run(operation(self, *args, **kwargs))

    return named(method, operation)


class _Connection(ConnectionBase):
    def __init__(self, address, tls=False, timeout_s=REQUEST_TIMEOUT_S, server=None, token=None, certificate=None,
                 retries=Retries()):
        super().__init__(address, timeout_s, server, token, retries)
        options, secure = channel_options(address), credentials(tls, certificate)
        self.channel = (grpc.aio.insecure_channel(address, options) if secure is None
                        else grpc.aio.secure_channel(address, secure, options))

    def open_stream(self, name, route):
        """The grpc call of a method with streams both ways; requests are written to it."""
        return self.call_of(name)(metadata=self.metadata_of_stream(route))

    async def read(self, stream, call, route, request):
        """The next message of `call`, or grpc.aio.EOF. Raises errors of this package alone. stream: whose call it is."""
        try:
            if not stream.is_closed:
                message = await call.read()
                if message is not grpc.aio.EOF and message.is_end:
                    await call.done_writing()
                    message = await call.read()
                return message
        except grpc.RpcError as error:
            raise self.error_of(error, route, request) from None
        except asyncio.CancelledError:
            if _is_cancelled() or not stream.is_closed:
                raise
        raise errors.Cancelled("the stream was closed", reason="STREAM_CLOSED")

    @staticmethod
    async def write(stream, call, message):
        """Sends a message, or nothing to a stream that has ended: whoever reads it is told why, as in `drape`. By the `write`
        of grpc.aio an error of its own would take the place of the server's, and of the answers before that."""
        if call.done():
            return
        try:
            await call.wait_for_connection()
            send = getattr(getattr(call, "_cython_call", None), "send_serialized_message", None)  # not for users: it may go
            await (send(message.SerializeToString()) if send else call.write(message))
        except (grpc.RpcError, grpc.aio.InternalError, asyncio.InvalidStateError):
            pass
        except asyncio.CancelledError:
            if _is_cancelled() or not stream.is_closed:
                call.cancel()
                raise

    async def run(self, operation):
        try:
            call = operation.send(None)
            while True:
                try:
                    answer = await self._ask(*self._begin(call))
                except GeneratorExit:  # the event loop has ended: nothing can be asked any more
                    raise
                except BaseException as error:
                    call = operation.throw(error)
                else:
                    call = operation.send(answer)
        except StopIteration as done:
            return done.value

    async def _ask(self, of, call, tries):
        sink = getattr(call, "sink", None)
        request = call.request
        while True:
            try:
                answer = (await self._sending(of, call, tries, iter_of_many(request)) if sink is None
                          else await self._read(of, call, tries, request))
                self._budget.refill()
                return answer
            except grpc.RpcError as error:
                pause_s = self._failed(error, call, tries)
            except asyncio.CancelledError as error:
                if _is_cancelled() or not self.closed:
                    raise
                raise errors.Cancelled("the client was closed meanwhile", reason="CLIENT_CLOSED") from error
            await asyncio.sleep(pause_s)
            request = self._again(call, request)

    async def _read(self, of, call, tries, request):
        under_way = self._sending(of, call, tries, request)
        try:
            async for answer in under_way:
                call.sink(answer)
                if call.rest is not None:
                    tries.has_brought_something()
        finally:
            under_way.cancel()

    async def close(self):
        if self.closed or os.getpid() != self._pid:
            return
        self.closed = True
        await self.channel.close()
        if self.server is not None:
            await asyncio.to_thread(self.server.stop)


class Pipeline(PipelineBase):
    __doc__ = PipelineBase.__doc__

    is_closed = False

    async def step(self, steps: int = 1, *, view=states.POSITIONS, report: bool = False, ids=None):
        """See `drape.Pipeline.step`."""
        request = self._prepare(steps, view, report, ids)
        if request is not None:
            await self._cloths._connection.write(self, self._answers, request)
        return await self._next() if self._is_full() else None

    async def drain(self) -> list:
        """Waits for the answers to all steps under way. Raises what `step` does."""
        return [answer async for answer in self._rest()]

    def close(self) -> None:
        """Cancels what is under way. Steps that the server has begun may be done."""
        self.is_closed = True
        self._answers.cancel()
        self._give_up(self._closed)

    async def _rest(self):
        for _ in range(len(self._under_way)):
            yield await self._next()

    async def _next(self):
        answer = self._of_nothing()
        while answer is None:
            try:
                response = await self._cloths._connection.read(self, self._answers, self._cloths._route,
                                                               self._next_request())
            except errors.Error as error:
                self._failed(error)
                raise
            if response is grpc.aio.EOF:
                raise self._failed(self._ended())
            answer = self._arrived(response)
        return answer

    async def __aenter__(self):
        return self

    async def __aexit__(self, kind, value, trace):
        try:
            if kind is None:
                await self.drain()
        finally:
            self.close()


class _Awaited:
    """What the streams of this module have in common. The first use sends what begins it."""

    is_closed = False

    async def _open(self):
        first, self._first = self._first, None
        if first is not None:
            await self._connection.write(self, self._call, first)
        return self

    async def _write(self, request):
        await self._open()
        await self._connection.write(self, self._call, request)

    async def _read(self):
        await self._open()
        answer = await self._connection.read(self, self._call, self._cloths._route, self._asked)
        if answer is grpc.aio.EOF:
            raise StopAsyncIteration
        return answer

    def close(self) -> None:
        """Ends it, at once. May be called again."""
        self.is_closed = True
        self._call.cancel()

    async def __aenter__(self):
        return await self._open()

    async def __aexit__(self, *_):
        self.close()

    def __aiter__(self):
        return self


class Frames(_Awaited, FramesBase):
    __doc__ = FramesBase.__doc__

    async def __anext__(self) -> Frame:
        chunks = [await self._read()]
        while not chunks[-1].is_last:
            chunks.append(await self._read())
        if self._gives_credit:
            await self._write(self._credit)
        return self._frame_of(chunks)


class Run(_Awaited, RunBase):
    __doc__ = RunBase.__doc__

    _is_stopped = False

    async def __anext__(self) -> v1.RunReport:
        return await self._read()

    async def pause(self) -> None:
        """See `drape.Run.pause`."""
        await self._ask_to_pause(True)

    async def resume(self) -> None:
        """See `drape.Run.resume`."""
        await self._ask_to_pause(False)

    async def stop(self) -> None:
        """See `drape.Run.stop`."""
        await self._open()
        self._is_stopped = True
        await self._call.done_writing()

    async def _ask_to_pause(self, is_paused):
        if not self._is_stopped:
            await self._write(v1.RunRequest(pause=is_paused))


class Cloths(ClothsBase):
    __doc__ = ClothsBase.__doc__

    step = _awaiting(ClothsBase._step)
    read = _awaiting(ClothsBase._read)
    reset = _awaiting(ClothsBase._reset)
    update = _awaiting(ClothsBase._update)
    describe = _awaiting(ClothsBase._describe)
    descriptions = _awaiting(ClothsBase._descriptions)
    delete = _awaiting(ClothsBase._delete)
    write = _awaiting(ClothsBase._write)
    save = _awaiting(ClothsBase._save)
    load = _awaiting(ClothsBase._load)
    drop = _awaiting(ClothsBase._drop)
    snapshot = _awaiting(ClothsBase._snapshot)
    topology = _awaiting(ClothsBase._topology)
    randomise = _awaiting(ClothsBase._randomise)
    render_png = _awaiting(ClothsBase._render_png)
    render = _awaiting(ClothsBase._render)
    render_tiles = _awaiting(ClothsBase._render_tiles)
    rollout = awaited_rollout

    def pipeline(self, depth: int = 2) -> Pipeline:
        """See `drape.Cloths.pipeline`; `async with`, and `await` its `step` and `drain`."""
        return Pipeline(self, depth)

    def frames(self, every: int = 1, *, max_hz: float = 0, every_frame: bool = False, velocities: bool = False,
               queue_frames: int = 0, queue_bytes: int = 0) -> Frames:
        """See `drape.Cloths.frames`; `async with` and `async for`."""
        return Frames(self, every, max_hz, every_frame, velocities, queue_frames, queue_bytes)

    def run(self, hz: float | None = None, *, max_steps: int = 0, max_behind_s: float = 0, report_every_s: float = 0,
            expected: int | None = None, ids=None) -> Run:
        """See `drape.Cloths.run`; `async with` and `async for`."""
        return Run(self, hz, max_steps, max_behind_s, report_every_s, expected, ids)

    async def triangles(self):
        """uint32[triangles, 3] of each cloth."""
        return (await self.topology()).triangles

    positions = property(lambda self: self._at_hand("positions", "read()"), doc="[n, particles, 3] of the last step or read.")
    velocities = property(lambda self: self._at_hand("velocities", "read(velocities=True)"),
                          doc="[n, particles, 3] of the last step or read.")
    time_s = property(lambda self: self._at_hand("time_s", "read()"), doc="float64[n] of the last step or read.")

    def _at_hand(self, name, how):
        value = getattr(self, f"_{name}")
        if value is None:
            raise errors.FailedPrecondition(f"{name}: the last step or read did not bring them, or something has changed them "
                                            f"since: await cloths.{how} first", reason="NOT_READ")
        return value


class Session(SessionBase):
    __doc__ = SessionBase.__doc__

    _cloths_class = Cloths

    def __init__(self, client, message, is_owner):
        super().__init__(client, message, is_owner)
        loop = asyncio.get_running_loop()
        self._lease = _Lease(self._connection, self.name, self.ttl_s)
        self._renewal = loop.create_task(self._lease.keep())
        self._end = weakref.finalize(self, _abandon, loop, self._renewal, self._connection, self.name, is_owner)
        self._end.atexit = False  # no event loop is left then

    create: Callable[..., Awaitable[Cloths]] = _awaiting(SessionBase._create)
    attach: Callable[..., Awaitable[Cloths]] = _awaiting(SessionBase._attach)
    restore: Callable[..., Awaitable[Cloths]] = _awaiting(SessionBase._restore)
    step: Callable[..., Awaitable[list[states.Answer]]] = _awaiting(SessionBase._step)
    list = _awaiting(SessionBase._list)
    renew = _awaiting(SessionBase._renew)
    reattach = _awaiting(SessionBase._reattach)

    @property
    def lease_error(self) -> errors.Error | None:
        """See `drape.Session.lease_error`."""
        return self._lease.error

    async def close(self):
        """Deletes it on the server, if it was created here. May be called again."""
        self._route = self._route._replace(is_closed=True)
        if self._end.detach():
            await _end(self._renewal, self._connection, self.name, self._is_owner)

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.close()


class _Lease:
    """Renews a lease until its task is cancelled or the session is gone. Knows the connection, not the session object,
    which may be collected meanwhile."""

    def __init__(self, connection, name, ttl_s):
        self._connection = connection
        self._call = Unary("RenewSession", v1.RenewSessionRequest(name=name), Route(name))
        self._interval_s = ttl_s / _RENEWALS_PER_LEASE
        self.error = None

    async def keep(self):
        while True:
            await asyncio.sleep(self._interval_s)
            try:
                await self._connection.run(iter_of(self._call))
            except errors.NotFound as error:
                self.error = error
                return
            except errors.Error:
                if self._connection.closed:
                    return  # any other error may pass: the next renewal tries again


async def _end(renewal, connection, name, is_owner):
    renewal.cancel()
    connection.told_steps.pop(name, None)
    if not is_owner or connection.closed:
        return
    with contextlib.suppress(errors.Error):  # else its lease ends it
        await connection.run(iter_of(Unary("DeleteSession", v1.DeleteSessionRequest(name=name), Route(name), _LAST_CALL_S)))


_ending = set()  # tasks: an event loop does not keep them


def _abandon(loop, *session):
    """A session was collected, in whatever thread: it ends in that of its event loop, if that still runs."""

    def begin():
        task = loop.create_task(_end(*session))
        _ending.add(task)
        task.add_done_callback(_ending.discard)

    with contextlib.suppress(RuntimeError):  # the loop is closed: the lease ends the session
        loop.call_soon_threadsafe(begin)


class Client(ClientBase):
    __doc__ = ClientBase.__doc__

    _session_class = Session
    session: Callable[..., Awaitable[Session]] = _awaiting(ClientBase._session)
    sessions = _awaiting(ClientBase._sessions)
    server_info = _awaiting(ClientBase._server_info)
    health = _awaiting(ClientBase._health)

    async def close(self):
        """Closes its sessions, the connection, and the private server. May be called again."""
        for session in list(self._open_sessions):
            await session.close()
        await self._connection.close()

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.close()


async def _open(connection, ready_timeout_s):
    client = Client(connection)
    try:
        await connection.run(client._introduce(ready_timeout_s))
    except BaseException:
        await client.close()
        raise
    return client


async def connect(address, *, tls=False, certificate=None, token=None, timeout_s=REQUEST_TIMEOUT_S, ready_timeout_s=5.0,
                  retries: Retries | None = Retries()) -> Client:
    """See `drape.connect`."""
    return await _open(_Connection(address, tls, timeout_s, token=token, certificate=certificate, retries=retries),
                       ready_timeout_s)


async def launch(backend="auto", *, program=None, flags=(), ready_timeout_s=60.0, timeout_s=REQUEST_TIMEOUT_S,
                 retries: Retries | None = Retries()) -> Client:
    """See `drape.launch`."""
    server = await asyncio.to_thread(PrivateServer, backend, program, flags, ready_timeout_s)
    return await _open(_Connection(server.address, timeout_s=timeout_s, server=server, retries=retries), ready_timeout_s)
