import copy
import hashlib
import os
import pathlib
import pickle
import re
import select
import signal
import subprocess
import sys
import warnings

import pytest

import drape
from conftest import DRAPE, ROOT, certificate_of, run_python, sheet


def test_the_versions_of_the_tree_agree():
    cmake = re.search(r"project\(drape VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    assert drape.__version__ == cmake


def test_a_second_client_connects(client):
    with drape.connect(client.address) as other:
        assert other.info.incarnation == client.info.incarnation
        assert other.health() is True
        assert "cpu" in repr(other)


def test_the_version_is_compared(client, monkeypatch):
    monkeypatch.setattr("drape.client.__version__", "99.0.0")
    with pytest.warns(drape.VersionWarning, match="99.0.0"):
        drape.connect(client.address).close()
    monkeypatch.undo()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drape.connect(client.address).close()


def test_nobody_there_is_a_connection_error():
    with pytest.raises(ConnectionError, match="no Drape server answers at 127.0.0.1:1") as caught:
        drape.connect("127.0.0.1:1", ready_timeout_s=1)
    assert isinstance(caught.value, drape.Unavailable) and caught.value.reason == "CANNOT_CONNECT"
    assert "may have been done" not in str(caught.value)
    with pytest.raises(drape.FailedPrecondition) as caught:
        drape.connect("127.0.0.1:1", tls="/nowhere/cert.pem")
    assert caught.value.reason == "TLS_FILE_FAILED"


def test_tls(tmp_path):
    cert, key = certificate_of(tmp_path, "drape")
    server = drape.private_server.PrivateServer("cpu", flags=[f"--tls-cert={cert}", f"--tls-key={key}"])
    try:
        with drape.connect(server.address, tls=str(cert)) as client, client.session() as session:
            assert session.create(sheet()).step().step_count == [1]
        with pytest.raises(drape.Unavailable):
            drape.connect(server.address, ready_timeout_s=1)
    finally:
        server.stop()


def test_what_is_no_certificate_is_refused_before_connecting(tmp_path):
    cert, key = certificate_of(tmp_path, "drape")
    text = tmp_path / "readme.txt"
    text.write_text("Certificates are in another folder.\n")
    broken = cert.read_text().replace("MII", "@@@")
    for given, named in [({"tls": b"junk"}, "tls: the bytes given have no certificates in PEM"),
                         ({"tls": str(text)}, f"tls: {text} has no certificates in PEM"), ({"tls": b""}, "tls: the bytes"),
                         ({"tls": broken.encode()}, "tls: the bytes"), ({"tls": key}, f"tls: {key} has no certificates"),
                         ({"tls": True, "certificate": (key, cert)}, f"certificate[0]: {key} has no certificates"),
                         ({"tls": cert, "certificate": (cert, text)}, f"certificate[1]: {text} has no private key in PEM")]:
        with pytest.raises(drape.FailedPrecondition, match=re.escape(named)) as caught:
            drape.connect("127.0.0.1:1", **given)
        assert caught.value.reason == "TLS_FILE_FAILED"
    pem = b"# Autorit\xc3\xa9\n" + cert.read_bytes() + b"# and again\n" + cert.read_bytes() + key.read_bytes()
    with pytest.raises(drape.Unavailable):  # it is a bundle
        drape.connect("127.0.0.1:1", tls=pem, certificate=(pem, pem), ready_timeout_s=0.5)


def test_a_certificate_of_the_client(tmp_path):
    cert, key = certificate_of(tmp_path, "alice")
    flags = [f"--tls-cert={cert}", f"--tls-key={key}", f"--tls-client-ca={cert}"]
    server = drape.private_server.PrivateServer("cpu", flags=flags)
    try:
        for own in ((cert, key), (cert.read_bytes(), key.read_bytes())):
            with drape.connect(server.address, tls=str(cert), certificate=own) as client:
                assert client.info.backend == "cpu"
        with pytest.raises(drape.Unavailable):
            drape.connect(server.address, tls=str(cert), ready_timeout_s=1)
    finally:
        server.stop()
    with pytest.raises(drape.InvalidArgument, match="certificate: needs tls"):
        drape.connect("127.0.0.1:1", certificate=(cert, key))


def test_tokens_tell_tenants_apart(tmp_path):
    lines = [f"{name} {hashlib.sha256(token.encode()).hexdigest()}\n" for name, token in (("a", "abc"), ("b", "xyz"))]
    (tmp_path / "tokens").write_text("".join(lines))
    server = drape.private_server.PrivateServer("cpu", flags=[f"--token-file={tmp_path / 'tokens'}"])
    try:
        for token in (None, "wrong"):
            with pytest.raises(drape.Unauthenticated) as caught:
                drape.connect(server.address, token=token)
            assert caught.value.reason == "INVALID_TOKEN" and isinstance(caught.value, PermissionError)
        told = subprocess.run([DRAPE, "info", f"--server={server.address}"], capture_output=True, text=True, timeout=30)
        assert told.returncode == 1 and "--token-file=FILE or $DRAPE_TOKEN" in told.stderr
        with drape.connect(server.address, token="abc") as mine, drape.connect(server.address, token="xyz") as yours:
            session = mine.session()
            assert session.create(sheet()).step().step_count == [1]
            with pytest.raises(drape.SessionLost):
                yours.session(name=session.name)
    finally:
        server.stop()


def test_a_closed_client_says_so_and_has_closed_its_sessions(client):
    other = drape.connect(client.address)
    session = other.session()
    cloths = session.create(sheet())
    other.close()
    with pytest.raises(drape.SessionLost):
        client.session(name=session.name)
    other.close()
    with pytest.raises(drape.FailedPrecondition, match="closed"):
        cloths.step()
    session.close()


def test_what_belongs_to_a_client_cannot_be_copied(client, session):
    for one in (client, session, session.create(sheet())):
        for copy_of in (copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match="attach to the session by its name"):
                copy_of(one)


def said_by_a_fork(asking):
    """What `asking` returns in a forked process, or the text of its error."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # a fork beside threads: what is tested here
        child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            os.write(writing, str(asking()).encode())
        except drape.Error as error:
            os.write(writing, f"{type(error).__name__}: {error}".encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        if not select.select([pipe], [], [], 60)[0]:
            os.kill(child, signal.SIGKILL)
        said = pipe.read()
    os.waitpid(child, 0)
    return said


def test_a_fork_is_refused_and_harms_nothing(session):
    cloths = session.create(sheet())
    said = said_by_a_fork(cloths.step)
    assert said.startswith("ForkedProcess") and f"belongs to process {os.getpid()}" in said and "spawn" in said
    assert cloths.step().step_count == [1]


def test_a_fork_makes_a_client_of_its_own(client, session):
    cloths = session.create(sheet())
    cloths.step()

    def step():
        with drape.connect(client.address) as mine, mine.session(name=session.name) as same:
            return same.attach().step().step_count[0]

    assert said_by_a_fork(step) == "2"
    assert cloths.step().step_count == [3]


def test_a_connection_keeps_nothing_of_a_session_that_is_closed(client):
    with client.session() as session:
        name = session.name
        session.create(sheet()).step()
        assert name in repr(vars(client._connection))
    assert name not in repr(vars(client._connection))


def test_a_program_ends_by_itself_and_quickly():
    """Without close(): threads, sessions and the server end with the program."""
    out = run_python("import drape, conftest\nclient = drape.launch('cpu')\nsession = client.session()\n"
                     "cloths = session.create(conftest.sheet())\ncloths.step()\nprint(client._connection.server.pid)",
                     cwd=pathlib.Path(__file__).parent)
    with pytest.raises(ProcessLookupError):
        os.kill(int(out), 0)


@pytest.mark.parametrize("use, extra", [
    ("import drape.gym", "gym"), ("import drape.viewer", "viewer"), ("import drape.gym.shards", "ray"),
    ("import drape.gym.sb3", "sb3"), ("next(iter(drape.rollout._shown(1, True)))", "progress")])
def test_a_missing_package_is_named_with_its_extra(use, extra):
    code = ("import importlib.util, drape\nfind = importlib.util.find_spec\n"
            "importlib.util.find_spec = lambda name, *rest: None if name in "
            f"{('gymnasium', 'viser', 'tqdm') if extra not in ('ray', 'sb3') else ('ray', 'stable_baselines3')} else find(name, *rest)\n"
            f"try: {use}\nexcept ModuleNotFoundError as error: print(error)")
    assert f"pip install --find-links build/wheels 'drape-sim[{extra}]'" in run_python(code)


def test_importing_needs_no_optional_package():
    code = ("import sys\nfor name in ('gymnasium', 'tqdm', 'PIL', 'trimesh', 'viser', 'torch'): sys.modules[name] = None\n"
            "import drape, drape.aio\nprint(drape.__version__)")
    assert run_python(code).strip() == drape.__version__
    assert sys.version_info >= (3, 10)
