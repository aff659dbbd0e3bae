"""When pictures are due."""


class Pace:
    """Every `interval_s`, counted from the first one, so that what a sleep or a picture takes too long is not added to all
    that follow. A picture that is late by more than an interval begins a new count: no burst makes up for it."""

    def __init__(self, interval_s):
        self._interval_s = interval_s
        self._due_s = None

    def left_s(self, now_s):
        """A picture is complete: how long to wait for the next one. now_s: by a clock that never goes back."""
        self._due_s = now_s if self._due_s is None else self._due_s
        self._due_s = max(self._due_s, now_s - self._interval_s) + self._interval_s
        return max(0.0, self._due_s - now_s)
