"""Pictures as arrays."""

from __future__ import annotations

import io

import numpy as np

from . import errors


def pixels_of(png: bytes) -> np.ndarray:
    """uint8[height, width, 3]."""
    try:
        from PIL import Image
    except ImportError as error:
        raise errors.Unimplemented("pictures as arrays need Pillow: pip install drape-sim[render], or use render_png()",
                                   reason="NO_PILLOW") from error
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
