"""A viewer in the browser (extra `viewer`): `python -m drape.viewer SCENE.json`, or --server and
--session to look at what somebody else steps. `drape.viewer.Window` is for programs and notebooks."""

from drape import extras

extras.need("viser", "viewer")

from .window import Window

__all__ = ["Window"]
