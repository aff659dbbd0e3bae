"""A session: the lease under which cloths live on a server."""

from __future__ import annotations

import reprlib
import threading
import weakref
from typing import Any

import numpy as np

from . import checks, columns, errors, states, v1
from .cloths import Cloths, ClothsBase
from .operations import Operation, Route, Unary, blocking, with_more

_RENEWALS_PER_LEASE = 3  # two may be lost
_MOST_ASKED_ALONE = 8  # more cloths are listed, up to 1000 in one request
_MOST_CREATED = 65536  # cloths by one request, of any server
_PIECE_BYTES = 4 << 20  # of a message to the server
_LAST_CALL_S = 2.0  # for a session that is deleted because nobody uses it: a dead server must not hold the program up


class SessionBase:
    """A lease on the server. name: "sessions/<server>-<token>"; it gives access, so keep it secret. ttl_s: after so
    long without a request the server deletes the session and its cloths. Safe to use from several threads.

    A server with checkpoints that has started again holds the session as it was some time before. Every request raises
    StateLost then, and does nothing, until `reattach`.
    """

    _cloths_class: Any

    def __init__(self, client, message, is_owner):
        self._client = client
        self._connection = client._connection
        self.name = message.name
        self._route = Route(message.name, message.incarnation)
        self.ttl_s = message.ttl_s
        self.dtype = client.dtype
        self._most_steps = client.info.limits.max_steps_per_request  # by one request
        self._is_owner = is_owner

    def __repr__(self):
        return f"<session {self.name[:20]}... at {self._connection.address}>"

    def _create(self, spec: v1.ClothSpec, count: int = 1, *, origins=None, transforms=None, overrides=None,
                world: str = "", request_id: str = "", timeout_s: float | None = None) -> Operation[Cloths]:
        """`count` cloths of `spec`, 1 to 65536, all or none.

        origins [m]: [count, 3], or [3] for all, of each cloth's environment in the world (default: all at the origin). transforms:
        [count, 7] position [m] and quaternion x, y, z, w, in the place of spec.transform. overrides: `count`
        ClothOverrides. world: a name; the cloths touch each other and all others of the session whose world has it, and
        are stepped together with them (`step`). request_id: a repetition with the same id gets the same cloths.
        Raises InvalidArgument, ResourceExhausted (QUOTA_EXCEEDED, BUILD_QUEUE_FULL, BUILD_TIME_EXCEEDED, DEVICE_MEMORY).
        """
        count = checks.whole("count", count, 1, 2**32 - 1, told=_MOST_CREATED)
        request = checks.message(v1.CreateClothsRequest, session=self.name, spec=spec, count=count,
                                 overrides=overrides, world=world, request_id=request_id)
        if origins is not None:
            origins = columns.shaped("origins", origins, (count, 3)).copy()
            columns.fill(request, {"environment_origins_m": origins})
        if transforms is not None:
            columns.fill(request, {"transforms": columns.shaped("transforms", transforms, (count, 7))})
        route = self._route._replace(name_of=lambda cloth: f"cloth {cloth}" if cloth < request.count else None)
        response = yield Unary("CreateCloths", request, route, timeout_s)
        return self._cloths_class(self, response.cloth_ids, response.shape, request.spec, origins)

    def _step(self, batches, steps: int = 1, *, report: bool = False, contacts: bool = False, expected: int | None = None,
              timeout_s: float | None = None) -> Operation[list[states.Answer]]:
        """Steps several `Cloths` of the session in one request, as the cloths of one world must be. An answer for each
        of them, without states. Arguments as of `Cloths.step`, and what it says of controls that wait.

        The backend `cpu` steps cloths of one size, settings and pins side by side, as many as it has lanes
        (`client.info.device` says how many). Where fewer are alike, whatever batches they are in, a particle takes up to 3
        times as long: `./run bench python --case sizes` measures it.

        Raises what `Cloths.step` does, FailedPrecondition (WORLD_INCOMPLETE), InvalidArgument for restarts of unlike kinds.
        """
        batches = self._batches(batches)
        if not batches:
            return []
        requests, together, taken = [], v1.StepRequest(), {}
        try:
            for cloths in batches:
                request, taken[cloths] = cloths._step_request(steps, None, report, None, None, expected,
                                                                contact_impulses=contacts)
                requests.append(request)
                together.MergeFrom(request)
            columns.check_alike([block for blocks in taken.values() for block in blocks])
            for cloths in batches:
                cloths._forget_states()
            route = self._route._replace(name_of=lambda cloth: _name_among(batches, cloth))
            response = yield Unary("Step", together, route, timeout_s)
        except errors.Error as error:
            for cloths, blocks in taken.items():
                cloths._put_back(blocks, error)
            raise
        answers, first = [], 0
        for cloths, request in zip(batches, requests):
            every = slice(first, first + cloths.num)
            first += cloths.num
            ids = set(cloths.ids.tolist())
            its = v1.StepResponse(steps=response.steps[every], reports=response.reports[every], timing=response.timing,
                                  faulted_cloth_ids=[cloth for cloth in response.faulted_cloth_ids if cloth in ids],
                                  contact_impulses=states.contacts_among(response.contact_impulses, cloths.ids))
            answers.append(cloths._take(its, None, request))
        return answers

    def _batches(self, batches):
        """`batches` as a list of batches of this session, each once."""
        try:
            found = list(batches)
        except TypeError:
            found = [None]
        if not all(isinstance(cloths, ClothsBase) for cloths in found):
            raise errors.bad_field("batches", f"{reprlib.repr(batches)} is not a list of Cloths")
        if any(cloths._session.name != self.name for cloths in found):
            raise errors.bad_field("batches", "are not all of this session")
        if len(set(found)) < len(found):
            raise errors.bad_field("batches", "one is given twice")
        return found

    def _attach(self, ids=None, spec: v1.ClothSpec | None = None) -> Operation[Cloths]:
        """Cloths that exist already. ids: their names in the protocol; None: all of the session. They must have equally
        many particles. spec: their description, if known, for who asks the batch for it. Raises InvalidArgument, NotFound
        (CLOTH_NOT_FOUND), FailedPrecondition (NO_CLOTHS)."""
        checks.of_kind("spec", spec, v1.ClothSpec)
        if ids is None:
            listed = yield from self._list()
            found = {cloth.id: cloth for cloth in listed}
        else:
            named = columns.distinct("ids", columns.cloth_ids("ids", ids))
            found = yield from self._described(named.tolist())
        if not found:
            raise errors.FailedPrecondition("the session has no cloths", reason="NO_CLOTHS")
        sizes = {cloth.shape.particles for cloth in found.values()}
        if len(sizes) > 1:
            raise errors.bad_field("ids", f"the cloths have unlike numbers of particles: {sorted(sizes)}")
        origins = np.array([list(cloth.environment_origin_m) or [0, 0, 0] for cloth in found.values()])
        cloths = self._cloths_class(self, list(found), next(iter(found.values())).shape, spec, origins)
        cloths.step_count[:] = [cloth.step for cloth in found.values()]
        cloths.faulted[:] = [cloth.faulted for cloth in found.values()]
        return cloths

    def _restore(self, snapshot: bytes, *, inexact: bool = False, spec: v1.ClothSpec | None = None,
                 request_id: str = "") -> Operation[Cloths]:
        """New cloths that go on from `cloths.snapshot()` with the bits that they would have had, all or none. inexact:
        accept a snapshot of another build, backend or device, whose cloths may go on with other bits; the number of threads
        does not matter. spec: see `attach`.
        request_id: a repetition with the same id and snapshot gets the same cloths.
        Raises InvalidArgument (SNAPSHOT_DAMAGED), FailedPrecondition (OTHER_BUILD, SNAPSHOT_TOO_NEW)."""
        if not isinstance(snapshot, (bytes, bytearray, memoryview)):
            raise errors.bad_field("snapshot", f"{type(snapshot).__name__} is not bytes")
        checks.of_kind("spec", spec, v1.ClothSpec)
        snapshot = bytes(snapshot)
        if not snapshot:
            raise errors.InvalidArgument("snapshot: is empty", reason="SNAPSHOT_DAMAGED", fields=[("snapshot", "is empty")])
        begin = checks.message(v1.ImportClothsRequest.Begin, session=self.name, inexact=inexact,
                               total_bytes=len(snapshot), request_id=request_id)
        response = yield Unary("ImportCloths", _Import(begin, snapshot), self._route)
        return (yield from self._attach(list(response.cloth_ids), spec))

    def _list(self) -> Operation[list[v1.Cloth]]:
        """Every cloth of the session, in order of creation. Raises SessionLost."""
        return (yield from self._listed(lambda cloth: True, None))

    def _listed(self, is_wanted, count):
        """The cloths that are wanted, `count` at most (None: all)."""
        cloths, token = [], ""
        while True:
            page = yield Unary("ListCloths", v1.ListClothsRequest(session=self.name, page_size=1000, page_token=token),
                               self._route)
            cloths.extend(cloth for cloth in page.cloths if is_wanted(cloth))
            token = page.next_page_token
            if not token or len(cloths) == count:
                return cloths

    def _described(self, ids):
        """id -> Cloth, in this order. Raises NotFound for what is not there."""
        found, wanted = {}, set(ids)
        if len(wanted) > _MOST_ASKED_ALONE:
            listed = yield from self._listed(lambda cloth: cloth.id in wanted, len(wanted))
            found = {cloth.id: cloth for cloth in listed}
        for cloth in wanted - found.keys():
            found[cloth] = yield Unary("GetCloth", v1.GetClothRequest(session=self.name, cloth_id=cloth), self._route)
        return {cloth: found[cloth] for cloth in ids}

    def _renew(self) -> Operation[None]:
        """Extends the lease to its full length, as every request does. Raises SessionLost."""
        yield Unary("RenewSession", v1.RenewSessionRequest(name=self.name), Route(self.name))

    def _reattach(self) -> Operation[None]:
        """After StateLost: takes the session as it came back from the server's checkpoint. Later steps, cloths and
        changes are lost, and so are saved states and request ids: make the batches anew, by `attach`. Raises SessionLost
        if it did not come back."""
        message = yield Unary("RenewSession", v1.RenewSessionRequest(name=self.name), Route(self.name))
        self._route = Route(self.name, message.incarnation)


def _name_among(batches, cloth):
    """What errors call a cloth of one of these; None of others."""
    return next((f"cloth {batch._row_of[cloth]} of batches[{k}]" for k, batch in enumerate(batches) if cloth in batch._row_of),
                None)


class _Import:
    """The messages of ImportCloths, from the first one on each time. Their id is that of the first one."""

    def __init__(self, begin, snapshot):
        self._begin = begin
        self._snapshot = snapshot

    def __iter__(self):
        yield v1.ImportClothsRequest(begin=self._begin)
        for at in range(0, len(self._snapshot), _PIECE_BYTES):
            yield v1.ImportClothsRequest(data=self._snapshot[at:at + _PIECE_BYTES])

    @property
    def request_id(self):
        return self._begin.request_id

    @request_id.setter
    def request_id(self, value):
        self._begin.request_id = value


def iter_of(call):
    """An operation of one request."""
    return (yield call)


class Session(SessionBase):
    __doc__ = with_more(SessionBase.__doc__, """
    Made by `Client.session`. A thread renews the lease. `with`, `close()` and the end of the program delete a session
    that was created here, with its cloths; one that was attached by its name is left alone. lease_error: why renewing
    gave up (the session is gone), else None.
    """)

    _cloths_class = Cloths

    def __init__(self, client, message, is_owner):
        super().__init__(client, message, is_owner)
        self._lease = _Lease(self._connection, self.name, self.ttl_s)
        self._end = weakref.finalize(self, _end, self._connection, self.name, self._lease, is_owner)
        self._lease.start()

    create = blocking(SessionBase._create)
    step = blocking(SessionBase._step)
    attach = blocking(SessionBase._attach)
    restore = blocking(SessionBase._restore)
    list = blocking(SessionBase._list)
    renew = blocking(SessionBase._renew)
    reattach = blocking(SessionBase._reattach)

    @property
    def lease_error(self) -> errors.Error | None:
        """Why renewing gave up: the session is gone; else None."""
        return self._lease.error

    def close(self) -> None:
        """Deletes it on the server, if it was created here. May be called again."""
        self._route = self._route._replace(is_closed=True)
        self._end()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_):
        self.close()


def _end(connection, name, lease, is_owner):
    lease.stop()
    connection.told_steps.pop(name, None)
    if not is_owner or connection.closed:
        return
    try:
        connection.run(iter_of(Unary("DeleteSession", v1.DeleteSessionRequest(name=name), Route(name), _LAST_CALL_S)))
    except errors.Error:
        pass  # then its lease ends it


class _Lease(threading.Thread):
    """Renews a lease until it is stopped or the session is gone. Knows the connection, not the session object, which
    may be collected meanwhile."""

    def __init__(self, connection, name, ttl_s):
        super().__init__(name="drape-lease", daemon=True)
        self._connection = connection
        self._session = name
        self._interval_s = ttl_s / _RENEWALS_PER_LEASE
        self._stopped = threading.Event()
        self.error = None

    def stop(self):
        self._stopped.set()

    def run(self):
        call = Unary("RenewSession", v1.RenewSessionRequest(name=self._session), Route(self._session),
                     min(self._interval_s, _LAST_CALL_S))
        while not self._stopped.wait(self._interval_s):
            try:
                self._connection.run(iter_of(call))
            except errors.NotFound as error:
                self.error = error
                return
            except (errors.Error, ValueError):  # ValueError: grpc says so of a channel that was closed meanwhile
                if self._connection.closed:
                    return  # any other error may pass: the next renewal tries again
