"""What a window of `drape.viewer` sends to a browser: read from its web socket, and not drawn."""

import socket
import time

import numpy as np
import viser
from websockets.sync.client import connect

from drape.viewer import Window

WARM_UP_S, MEASURED_S = 1.0, 5.0


def measure(batch, cpu_s):
    """Of a window that plays `batch`: pictures per second, kB and CPU ms (of this process, the reader with it) of one.
    cpu_s(): of this process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    least_bytes = 6 * batch.num * batch.particles  # half of the positions of a picture
    with Window([batch], port=port) as window, \
            connect(f"ws://127.0.0.1:{port}", subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as reader:
        window.play.value = True
        begin, sizes, times = time.monotonic(), [], []
        while not times or times[-1] < WARM_UP_S + MEASURED_S:
            size, now = len(reader.recv()), time.monotonic() - begin
            if size <= least_bytes or now < WARM_UP_S:
                continue
            if not times:
                begin_cpu_s = cpu_s()
            sizes.append(size)
            times.append(now)
        pictures = len(times) - 1  # from the first one to the last one
        return {"pictures_per_s": pictures / (times[-1] - times[0]), "kB": float(np.median(sizes)) / 1000,
                "client_cpu_ms": 1e3 * (cpu_s() - begin_cpu_s) / pictures}
