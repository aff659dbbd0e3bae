"""What an update mask names, taken from one message into another."""


def merge(paths, source, target):
    """The fields of `target` that `paths` name become those of `source`, unset ones unset."""
    for path in paths:
        *parents, name = path.split(".")
        here, there = source, target
        for parent in parents:
            here, there = getattr(here, parent), getattr(there, parent)
        there.ClearField(name)
        for field, value in here.ListFields():  # what is set
            if field.name == name:
                there.MergeFrom(type(there)(**{name: value}))
