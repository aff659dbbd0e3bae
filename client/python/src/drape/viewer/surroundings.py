"""Gravity and wind of the cloths in a window, and the controls that change them."""

from __future__ import annotations

import numpy as np

from drape import v1

_DEFAULT = {"gravity": (0.0, -9.81, 0.0), "wind": (0.0, 0.0, 0.0)}
_MOST_GRAVITY_M_PER_S2 = 20.0  # at either end of the slider, if no cloth has more


def own(name, cloth):
    """[3]: "gravity" or "wind" of a described cloth."""
    field = {"gravity": cloth.environment.gravity_m_per_s2, "wind": cloth.environment.wind_m_per_s}[name]
    return np.array(field or _DEFAULT[name], float)


class Surroundings:
    """The controls show what the first cloth has. One that is moved sets that component of all cloths; whatever else
    they have stays, each cloth's own."""

    def __init__(self, gui, batches):
        self._batches = batches
        self._shown = {name: np.array(_DEFAULT[name]) for name in _DEFAULT}
        self.gravity = gui.add_slider("gravity [m/s²]", -_MOST_GRAVITY_M_PER_S2, _MOST_GRAVITY_M_PER_S2, 0.1,
                                      _DEFAULT["gravity"][1])
        self.wind = gui.add_vector3("wind [m/s]", _DEFAULT["wind"], step=0.5)
        self.follow()

    def follow(self):
        """Shows what the first cloth has now, if somebody else has changed it."""
        cloth = self._batches[0].describe(0)
        for name, shown in self._shown.items():
            now = own(name, cloth)
            if (now == shown).all():
                continue
            self._shown[name] = now
            if name == "wind":
                self.wind.value = tuple(now)
            else:
                self.gravity.min = min(-_MOST_GRAVITY_M_PER_S2, now[1])
                self.gravity.max = max(_MOST_GRAVITY_M_PER_S2, now[1])
                self.gravity.value = now[1]

    def apply(self):
        """What was moved since."""
        gravity = self._shown["gravity"].copy()
        gravity[1] = self.gravity.value
        for name, now in (("gravity", gravity), ("wind", np.array(self.wind.value))):
            is_moved = now != self._shown[name]
            if not is_moved.any():
                continue
            self._shown[name] = now
            for cloths in self._batches:
                values = np.array([own(name, cloth) for cloth in cloths.descriptions()])
                values[:, is_moved] = now[is_moved]
                _set(cloths, name, values)


def _set(cloths, name, values):
    """values: [n, 3]."""
    if (values != values[0]).any():
        cloths.randomise(**{name: values})
        return
    field = {"gravity": "gravity_m_per_s2", "wind": "wind_m_per_s"}[name]
    environment = v1.Environment(**{field: values[0].tolist()})
    cloths.update(v1.ClothSpec(environment=environment), [f"environment.{field}"])
