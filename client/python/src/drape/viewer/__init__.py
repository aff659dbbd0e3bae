"""A viewer in the browser (pip install drape-sim[viewer]): `python -m drape.viewer SCENE.json`, or --server and
--session to look at what somebody else steps. `drape.viewer.Window` is for programs and notebooks."""

from .window import Window

__all__ = ["Window"]
