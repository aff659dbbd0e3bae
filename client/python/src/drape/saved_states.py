"""States that are kept to go on from: on the server by a name, or as bytes."""

from __future__ import annotations

import contextlib
import uuid
from typing import Any

import numpy as np

from . import checks, columns, errors, v1
from .operations import Operation, Reading, Unary

# For the request that tidies up after one that failed or was interrupted: a dead server must not hold the program up.
_TIDY_UP_S = 2.0


class SavedStates:
    """Part of `Cloths`."""

    num: int
    ids: np.ndarray
    faulted: np.ndarray
    _session: Any
    _route: Any
    _pending: columns.Pending
    _faulted_when_saved: dict

    def _save(self, name: str, ids=None) -> Operation[None]:
        """Keeps the cloths as they are by `name`, in the server's memory: everything that they go on from. Replaces
        what had the name. Raises InvalidArgument, ResourceExhausted (TOO_MANY_SAVED_STATES), NotFound (CLOTH_NOT_FOUND);
        `drop` frees the memory."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        request = checks.message(v1.SaveStatesRequest, session=self._session.name, name=name)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        yield Unary("SaveStates", request, self._route)
        self._faulted_when_saved[name] = self.faulted.copy()

    def _load(self, name: str, ids=None, *, of=None) -> Operation[None]:
        """The cloths of `ids` go on from what `save` kept, with the same bits, parameters and pins included; controls
        that wait are forgotten. of: which saved cloths they become, as their indices in this batch (not among
        those that were saved), [m] or one for all (several may become the same one); None: each itself. Raises NotFound
        (SAVED_STATES_NOT_FOUND), InvalidArgument where shape or place differ, or a cloth of `of` was not saved."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        request = checks.message(v1.LoadStatesRequest, session=self._session.name, name=name)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        of = None if of is None else columns.spread("of", columns.indices("of", of, self.num), (len(self._every(rows)),))
        if of is not None:
            columns.fill(request, {"saved_cloth_ids": self.ids[of].tolist()})
        yield Unary("LoadStates", request, self._route)
        self._pending.drop(rows, self.num)
        self._forget_states()
        yield from self._read(particles=[0], ids=ids)  # which step they are at
        every = self._every(rows)
        known = self._faulted_when_saved.get(name)
        self.faulted[every] = False if known is None else known[every if of is None else of]

    def _drop(self, name: str) -> Operation[None]:
        """Forgets what `save` kept by this name. Raises NotFound (SAVED_STATES_NOT_FOUND)."""
        request = checks.message(v1.DropStatesRequest, session=self._session.name, name=name)
        self._faulted_when_saved.pop(name, None)
        yield Unary("DropStates", request, self._route)

    def _snapshot(self, ids=None) -> Operation[bytes]:
        """The cloths as bytes, with everything that they go on from; `session.restore` makes cloths of them, here or on
        another server of the same build. They count among the server's saved states while they come. Raises
        InvalidArgument if no cloth is named, ResourceExhausted (TOO_MANY_SAVED_STATES, SNAPSHOT_TOO_LARGE,
        BUILD_TIME_EXCEEDED), NotFound (CLOTH_NOT_FOUND)."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            raise errors.bad_field("ids", "no cloth is named")
        name = f"snapshot-{uuid.uuid4().hex}"
        route, pieces = self._route, []
        # With ids, so that cuts do no harm: nobody else has the name.
        request = v1.SaveStatesRequest(session=route.session, name=name, request_id=name)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        drop = v1.DropStatesRequest(session=route.session, name=name, request_id=f"drop-{name}")

        def rest():
            return v1.ExportClothsRequest(session=route.session, name=name, offset=sum(map(len, pieces)))

        try:
            yield Unary("SaveStates", request, route)
            yield Reading("ExportCloths", rest(), route, lambda chunk: pieces.append(chunk.data), rest=rest)
        except GeneratorExit:  # nobody asks the server any more: the session's end frees the memory
            raise
        except BaseException:  # Ctrl-C and cancelled tasks, too
            with contextlib.suppress(errors.Error):  # what happened first is what counts
                yield Unary("DropStates", drop, route, _TIDY_UP_S)
            raise
        yield Unary("DropStates", drop, route)
        return b"".join(pieces)
