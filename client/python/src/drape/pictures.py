"""Pictures of cloths, which the server draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import checks, columns, errors, v1
from .operations import Operation, Unary

_OF_THE_BATCH = ("session", "cloth_ids", "all_cloths")  # fields of RenderRequest that a batch fills


class Pictures:
    """Part of `Cloths`."""

    num: int
    _session: Any
    _route: Any

    def _render_png(self, width: int = 960, height: int = 720, *, ids=None, timeout_s: float | None = None,
                    **options) -> Operation[bytes]:
        """A PNG file of the cloths as they are. options: further fields of RenderRequest, e.g. `camera=Camera(...)`,
        `colouring=RenderRequest.STRAIN`. Raises FailedPrecondition (NO_EGL_DEVICE) if the server cannot draw,
        InvalidArgument, also if no cloth is named, ResourceExhausted (TOO_MANY_PICTURES, PICTURE_TOO_LARGE)."""
        response = yield from self._drawn(ids, timeout_s, options, width_px=width, height_px=height)
        return response.png

    def _render(self, width: int = 960, height: int = 720, *, ids=None, with_depths: bool = False,
                timeout_s: float | None = None, **options) -> Operation[Any]:
        """The picture of `render_png` as uint8[height, width, 3], read-only. with_depths: a pair of it and
        float32[height, width], how far along the line of view the nearest thing is, at one point within each pixel [m];
        infinity where there is nothing. Raises what `render_png` does."""
        response = yield from self._drawn(ids, timeout_s, options, width_px=width, height_px=height, depths=with_depths,
                                          encoding=v1.RenderRequest.RGB8)
        return _pixels(response, (height, width), with_depths)

    def _render_tiles(self, width: int, height: int, camera, *, ids=None, with_depths: bool = False,
                      timeout_s: float | None = None, **options) -> Operation[Any]:
        """A picture of every cloth alone, uint8[m, height, width, 3], read-only, in one request. camera: a Camera in the
        environment of each cloth. with_depths: a pair of it and float32[m, height, width], as of `render`. options: as of
        `render_png`. At most 2^24 pixels in all, 2^23 with depths. Raises what `render_png` does."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return _pixels(v1.RenderResponse(), (0, height, width), with_depths)
        response = yield from self._drawn(ids, timeout_s, options, width_px=width, height_px=height, camera=camera, tiles=True,
                                          depths=with_depths, encoding=v1.RenderRequest.RGB8)
        return _pixels(response, (-1, height, width), with_depths)

    def _drawn(self, ids, timeout_s, options, **fields):
        for name in options:
            if name in fields or name in _OF_THE_BATCH:
                raise errors.bad_field(name, "is no option: the other arguments say it")
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            raise errors.bad_field("ids", "nothing is selected")
        request = checks.message(v1.RenderRequest, session=self._session.name, **fields, **options)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        return (yield Unary("Render", request, self._route, timeout_s))


def _pixels(response, shape, with_depths):
    rgb = np.frombuffer(response.rgb, np.uint8).reshape(*shape, 3)
    return (rgb, np.frombuffer(response.depths_m, "<f4").reshape(shape)) if with_depths else rgb
