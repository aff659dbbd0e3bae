"""The allocator of glibc, which by default gives the memory of every large answer back to the system, and asks for it
again at the next one. Keeping it saves a third of the client's CPU time for answers of 0.8 MB (`Python, DRAPE_MALLOPT=0` of
`./run bench python`)."""

import ctypes
import os
import platform

_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_LARGEST_HEAP_BLOCK_BYTES = 32 << 20
_KEPT_BYTES = 64 << 20

_is_done = False


def keep_freed_blocks():
    """Once per process, when the first client is made; `DRAPE_MALLOPT=0` forbids it. Keeps at most 64 MiB."""
    global _is_done
    if _is_done:
        return
    _is_done = True
    if os.environ.get("DRAPE_MALLOPT") == "0" or platform.libc_ver()[0] != "glibc":
        return
    libc = ctypes.CDLL(None)
    libc.mallopt(_M_MMAP_THRESHOLD, _LARGEST_HEAP_BLOCK_BYTES)
    libc.mallopt(_M_TRIM_THRESHOLD, _KEPT_BYTES)
