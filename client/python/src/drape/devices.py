"""Which GPU of the machine this process was given, as `draped --device` calls it.

Ray, Slurm and container runtimes say so by CUDA_VISIBLE_DEVICES, which EGL does not heed: it holds UUIDs, or indices in the
order of nvidia-smi, that of PCI addresses. EGL's own indices have the driver's order, another one perhaps.
"""

from __future__ import annotations

import os
import subprocess
from typing import NamedTuple

from . import errors
from .private_server import find_server

_VARIABLE = "CUDA_VISIBLE_DEVICES"
_LIST_TIMEOUT_S = 60


class Device(NamedTuple):
    """A line of `draped --list-devices`."""

    index: str
    pci_address: str
    uuid: str
    is_software: bool

    def is_called(self, name):
        name = name.lower()
        return name == self.pci_address.lower() or (name.startswith("gpu-") and self.uuid.lower().startswith(name))

    def name(self):
        return self.uuid or self.pci_address or self.index


def assigned(program=None):
    """For `--device=` of a server that this process starts: the first GPU of CUDA_VISIBLE_DEVICES; None if that is unset or
    empty, or if the server finds no GPU at all. program: see `drape.find_server`. Raises FailedPrecondition
    (NO_SUCH_DEVICE) when the server has GPUs, but not that one."""
    first = os.environ.get(_VARIABLE, "").split(",")[0].strip()
    if first in ("", "-1"):
        return None
    text = _output(find_server(program), "--list-devices") or ""
    devices = [device for device in map(_device_of, text.splitlines()) if not device.is_software]
    if not devices:
        return None
    found = _by_index(int(first), devices) if first.isdigit() else [device for device in devices if device.is_called(first)]
    if len(found) != 1:
        raise errors.FailedPrecondition(
            f"{_VARIABLE} gives this process the GPU {first!r}, which is not one of those that `draped --list-devices` "
            f"tells:\n{text.rstrip()}", reason="NO_SUCH_DEVICE")
    return found[0].name()


def _by_index(index, devices):
    rows = _output("nvidia-smi", "--query-gpu=index,uuid,pci.bus_id", "--format=csv,noheader")
    if rows is None:  # no NVIDIA driver, or none of its tools
        ordered = sorted(devices, key=lambda device: (device.pci_address == "", device.pci_address))
        return ordered[index:index + 1]
    for row in rows.splitlines():
        number, uuid, pci_address = (part.strip() for part in row.split(","))
        if number == str(index):
            domain, _, rest = pci_address.partition(":")  # of eight digits there
            names = uuid, f"{domain[-4:]}:{rest}"
            return [device for device in devices if any(map(device.is_called, names))]
    return []


def _device_of(line):
    index, *words = line.split()
    return Device(index, next((word for word in words if ":" in word), ""),
                  next((word for word in words if word.startswith("GPU-")), ""), "(software)" in words)


def _output(*command):
    """None if there is no such program, or it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIST_TIMEOUT_S)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None
