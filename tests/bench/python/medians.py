"""Medians that say how sure they are."""

import math

import numpy as np

_Z_95 = 1.96  # 95 % of a normal distribution are within so many standard deviations


def of_median(values):
    """The median, and the order statistics within which it is by 95 % whatever the distribution (sign test)."""
    ordered = np.sort(values)
    half_width = _Z_95 * math.sqrt(len(ordered)) / 2
    low = max(0, math.floor(len(ordered) / 2 - half_width))
    high = min(len(ordered) - 1, math.ceil(len(ordered) / 2 + half_width))
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])
