"""A server behind HAProxy with docker/exposed/haproxy.cfg: what clients do passes, floods do not."""

import sys

import numpy as np
import pytest

import drape
from conftest import ROOT, certificate_of, sheet
from stream_ends import all_ends_are_told

BENCH = ROOT / "tests/bench/service"
# More than a server with one small cloth needs, less than a flood takes from one that has no proxy before it: gigabytes.
ENOUGH_MB = 300


@pytest.fixture(scope="module")
def exposed():
    """The server, and the classes to put something before and beside it."""
    sys.path.insert(0, str(BENCH))
    import draped
    with draped.Draped("--max-connections-per-peer=0") as server:
        yield server, draped
    sys.path.remove(str(BENCH))


@pytest.mark.full
def test_all_kinds_of_requests_pass_encrypted(exposed, tmp_path):
    server, draped = exposed
    certificate, key = certificate_of(tmp_path, "drape")
    pem = tmp_path / "drape.pem"
    pem.write_bytes(certificate.read_bytes() + key.read_bytes())
    with draped.Proxy(server.address, pem) as proxy, drape.connect(proxy.address, tls=str(certificate)) as client, \
            client.session() as session, drape.launch("cpu") as other:
        cloths, alone = session.create(sheet(32), 64), other.session().create(sheet(32), 64)
        with cloths.pipeline(depth=4) as pipeline:
            for _ in range(8):
                pipeline.step()
        watching = cloths.frames(every_frame=True)
        seen = [next(watching).step_count.max()]
        for _ in range(3):
            cloths.step()
            seen.append(next(watching).step_count.max())
        watching.close()
        steps = int(cloths.read().step_count[0])
        alone.step(steps)
        alone.read()
        assert seen == [8, 9, 10, 11]
        assert np.array_equal(cloths.positions, alone.positions)


@pytest.mark.full
def test_streams_end_as_without_a_proxy(exposed):
    server, draped = exposed
    with draped.Proxy(server.address) as proxy:
        all_ends_are_told(proxy.address)


@pytest.mark.full
@pytest.mark.parametrize("kind", ["rapid_reset", "messages_reset", "continuation", "half_messages"])
def test_floods_reach_neither_the_server_nor_other_clients(exposed, kind):
    server, draped = exposed
    greedy = [sys.executable, "-B", BENCH / "greedy.py", kind]
    with draped.Proxy(server.address) as proxy, draped.Beside([[*greedy, proxy.address]] * 2, settle_s=4):
        with drape.connect(proxy.address) as client, client.session() as session:
            cloths = session.create(sheet())
            for k in range(500):
                cloths.step()
            assert cloths.read().step_count.tolist() == [500]
        assert server.resident_mb() < ENOUGH_MB
        assert proxy.resident_mb() < ENOUGH_MB


@pytest.mark.full
def test_half_sent_messages_take_no_more_than_the_server_gives_its_transport(exposed):
    _, draped = exposed
    most_mb = 128
    with draped.Draped(f"--max-transport-bytes={most_mb << 20}") as server:
        before_mb = server.resident_mb()
        with draped.Beside([[sys.executable, "-B", BENCH / "greedy.py", "uploads", server.address]] * 2, settle_s=5):
            # 64 messages of 60 MB, which take 2.2 GB where the transport may. gRPC does not count all that it takes for them.
            assert server.resident_mb() < before_mb + 4 * most_mb
