import asyncio
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

import drape
import drape.aio
from conftest import sheet
from drape import private_server

HERE = pathlib.Path(__file__).parent
_STEPPING = """
import drape, conftest, sys
client = drape.launch("cpu")
cloths = client.session().create(conftest.sheet(48), count=8)
print(client._connection.server.pid, flush=True)
while True: cloths.step(100, view=None)
"""


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"


def wait_until_gone(pid, within_s=10.0):
    end = time.monotonic() + within_s
    while is_alive(pid) and time.monotonic() < end:
        time.sleep(0.01)
    return not is_alive(pid)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_the_server_dies_with_its_program(how):
    program = subprocess.Popen([sys.executable, "-c", _STEPPING], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True, cwd=HERE)
    server = int(program.stdout.readline())
    time.sleep(0.2)
    program.send_signal(how)
    _, said = program.communicate(timeout=20)
    assert wait_until_gone(server)
    if how == signal.SIGINT:
        assert said.rstrip().endswith("KeyboardInterrupt")
    assert program.returncode == -how


def test_it_outlives_the_thread_that_launched_it():
    import threading

    found = []
    thread = threading.Thread(target=lambda: found.append(drape.launch("cpu")))
    thread.start()
    thread.join()
    time.sleep(0.1)
    with found[0] as client:
        assert client.health()


def test_close_ends_it():
    client = drape.launch("cpu")
    pid = client._connection.server.pid
    assert is_alive(pid)
    client.close()
    assert not is_alive(pid)


def test_nothing_is_left_open():
    """Python tells of files that nobody closed, and pytest makes that the warning of some test of the user."""
    program = """
import gc, drape, drape.aio, asyncio
for is_closed in (True, False):
    client = drape.launch("cpu")
    session = client.session()
    client.close() if is_closed else None
    del client, session
    gc.collect()
async def launched():
    async with await drape.aio.launch("cpu") as client, await client.session():
        pass
asyncio.run(launched())
try:
    drape.launch("cpu", flags=["--bogus"])
except drape.InvalidArgument:
    pass
"""
    done = subprocess.run([sys.executable, "-X", "dev", "-c", program], capture_output=True, text=True, check=True)
    assert "ResourceWarning" not in done.stderr


def test_the_end_of_the_server_is_told_with_its_log():
    with drape.launch("cpu") as client:
        cloths = client.session().create(sheet())
        os.kill(client._connection.server.pid, signal.SIGKILL)
        with pytest.raises(drape.Unavailable, match="was ended by SIGKILL; the end of its log:"):
            cloths.step()


def test_a_server_that_does_not_start_says_why(tmp_path):
    ending = tmp_path / "draped"
    ending.touch(0o755)
    for status, said in ((1, "no memory"), (2, "")):  # 2 with words is for flags (test_checks.py)
        ending.write_text(f"#!/bin/sh\nprintf '{said}'\nexit {status}\n")
        with pytest.raises(drape.Unavailable, match=rf"ended with status {status} (.|\n)*{said or 'no log'}") as caught:
            drape.launch(program=str(ending))
        assert caught.value.reason == "SERVER_ENDED"
    with pytest.raises(drape.NotFound) as caught:
        drape.launch(program="/nowhere/draped")
    assert caught.value.reason == "NO_SERVER_PROGRAM"


def test_without_egl_it_computes_on_the_cores_and_does_not_draw(monkeypatch, tmp_path):
    (tmp_path / "libEGL.so.1").write_bytes(b"")  # found before the real one, and no library
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    with drape.launch("auto") as client, client.session() as session:
        assert client.info.backend == "cpu"
        cloths = session.create(sheet())
        assert cloths.step().step_count == [1]
        with pytest.raises(drape.FailedPrecondition, match="libEGL.so.1 is not installed") as caught:
            cloths.render_png(64, 64)
        assert caught.value.reason == "NO_EGL_DEVICE"
    with pytest.raises(drape.Unavailable, match="libEGL.so.1 is not installed"):
        drape.launch("gl")


def test_find_server_order(monkeypatch, tmp_path):
    def program(place):
        file = tmp_path / place / "draped"
        file.parent.mkdir(parents=True)
        file.write_text("#!/bin/sh\n")
        file.chmod(0o755)
        return str(file)

    asked, named, built, installed = (program(place) for place in ("a", "b", "tree/build/release/bin", "path"))
    (tmp_path / "tree/proto/drape/v1").mkdir(parents=True)
    monkeypatch.setattr(private_server, "__file__", str(tmp_path / "tree/client/python/src/drape/private_server.py"))
    monkeypatch.setattr(private_server, "_installed_from", lambda: None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.setenv("DRAPE_SERVER", named)
    assert drape.find_server(asked) == asked
    assert drape.find_server() == named
    monkeypatch.setenv("DRAPE_SERVER", str(tmp_path / "none"))
    with pytest.raises(drape.NotFound, match="none"):
        drape.find_server()
    monkeypatch.delenv("DRAPE_SERVER")
    assert drape.find_server() == built
    monkeypatch.setattr(private_server, "__file__", str(tmp_path / "lib/site-packages/drape/private_server.py"))
    assert drape.find_server() == installed
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(drape.NotFound, match=r"run build in a checkout.*set DRAPE_SERVER=/PATH/build/release/bin/draped.*pip "
                                             r"install --find-links build/wheels 'drape-sim\[server\]'") as caught:
        drape.find_server()
    assert caught.value.reason == "NO_SERVER_PROGRAM"
    monkeypatch.setattr(private_server, "_installed_from", lambda: tmp_path / "tree/client/python")
    assert drape.find_server() == built  # a copy that pip made of the checkout
    os.unlink(built)
    with pytest.raises(drape.NotFound, match=f"{tmp_path}/tree/run build, then set DRAPE_SERVER={built}"):
        drape.find_server()


def test_a_wrong_path_in_the_environment_is_told_with_where_it_is_from(monkeypatch):
    monkeypatch.setenv("DRAPE_SERVER", "/none/draped")
    with pytest.raises(drape.NotFound, match="no server program at /none/draped, where .DRAPE_SERVER says that it is"):
        drape.find_server()
    with pytest.raises(drape.NotFound, match="no server program at /other/draped$"):
        drape.find_server("/other/draped")


def test_who_waits_without_end_gets_a_server():
    with drape.launch("cpu", flags=["--threads=1"], ready_timeout_s=None) as client:
        assert client.health()

    async def program():
        async with await drape.aio.launch("cpu", flags=["--threads=1"], ready_timeout_s=None) as client:
            return await client.health()

    assert asyncio.run(program())
