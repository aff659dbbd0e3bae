"""A task of which only the bookkeeping is tested."""

from drape.gym import DropFlat

NUM = 3


class Short(DropFlat):
    """DropFlat with few particles and actions."""

    side = 8
    action_repeat = 2
    horizon = 4
