import hashlib
import queue
import threading
import time

import numpy as np
import pytest

import drape
from conftest import ROOT, certificate_of, sheet, wait_for
from drape.viewer import Window
from drape.viewer.__main__ import main


def test_play_step_reset_and_recording(session, free_port, tmp_path):
    cloths = session.create(sheet(), count=3, origins=[[0, 0, 0], [2, 0, 0], [4, 0, 0]])
    with Window([cloths], port=free_port) as window:
        assert window.url.endswith(str(free_port))
        assert tuple(window.colouring.options) == ("cloth", "strain", "speed")
        window.start_recording()
        window.ask_step(3)
        wait_for(lambda: "step 3," in window.status.content)
        shown = window._drawings[0]._surface.vertices
        assert np.array_equal(shown, cloths.positions.reshape(-1, 3))
        window.play.value = True
        wait_for(lambda: cloths.step_count[0] > 10)
        window.play.value = False
        for name in ("strain", "speed"):
            window.colouring.value = name
            wait_for(lambda name=name: f"largest {name}" in window.status.content)
            assert len(np.unique(window._drawings[0]._dots.colors, axis=0)) > 3
        window.ask_reset()
        wait_for(lambda: cloths.step_count[0] == 0)
        window.save_recording(tmp_path / "x.html")
        assert (tmp_path / "x.html").read_text().lstrip().lower().startswith("<!doctype html>")
        with pytest.raises(drape.FailedPrecondition):
            window.save_recording(tmp_path / "x.html")
    window.close()
    assert cloths.step().step_count[0] == 1


def test_a_recording_that_cannot_be_written_is_kept(session, free_port, tmp_path):
    with Window([session.create(sheet())], port=free_port) as window:
        window.start_recording()
        window.ask_step(2)
        wait_for(lambda: "step 2," in window.status.content)
        with pytest.raises(OSError):
            window.save_recording(tmp_path / "nowhere" / "x.html")
        window.save_recording(tmp_path / "x.html")
        size = (tmp_path / "x.html").stat().st_size
        with pytest.raises(drape.FailedPrecondition):
            window.save_recording(tmp_path / "y.html")
        window.start_recording()
        window.save_recording(tmp_path / "y.html")
        assert (tmp_path / "y.html").stat().st_size < size, "without the two steps"


def test_steps_that_cannot_be_done_are_refused_where_they_are_asked_for(session, free_port):
    """Not in the thread of the window, which they would end."""
    cloths = session.create(sheet())
    with Window([cloths], port=free_port) as window:
        for steps in (-1, 0, 1.5, "a"):
            with pytest.raises(drape.InvalidArgument, match="steps: .* is not a whole number"):
                window.ask_step(steps)
        window.ask_step(2)
        wait_for(lambda: cloths.step_count[0] == 2)


def test_the_button_ends_a_recording_only_for_a_browser_that_gets_it(session, free_port):
    sent = []

    class Event:
        client = None

    class Browser:
        @staticmethod
        def send_file_download(name, content, save_immediately):
            sent.append((name, content[:15].lower()))

    class Button:
        label = "record"

    with Window([session.create(sheet())], port=free_port) as window:
        event, button = Event(), Button()
        window._toggle_recording(event, button)
        window._toggle_recording(event, button)
        assert window._recording is not None and button.label == "stop and save"
        event.client = Browser
        window._toggle_recording(event, button)
        assert window._recording is None and button.label == "record"
    assert sent == [("drape.html", b"<!doctype html>")]


def test_a_colouring_chosen_amid_a_picture_counts_from_the_next(session, free_port):
    with Window([session.create(sheet(), count=1)], port=free_port) as window:
        drawing, drawn = window._drawings[0], []
        update = drawing.update

        def choose_amid(colouring):
            top = update(colouring)
            window.colouring.value = "speed" if colouring == "cloth" else "cloth"
            drawn.append(colouring)
            return top

        drawing.update = choose_amid
        wait_for(lambda: len(drawn) >= 4)
        assert {"cloth", "speed"} <= set(drawn)


def test_a_drag_pulls_the_nearest_particle_and_lets_go(session, free_port):
    cloths = session.create(sheet(max_grips=1), count=2, origins=[[0, 0, 0], [2, 0, 0]])
    with Window([cloths], port=free_port) as window:
        corner = np.array([2, 0, 1.0])  # particle 30 of the second sheet
        drag = window._drawings[0]

        def pull(phase, to):
            window._drags.put((drag, phase, corner + 0.02, to))
            wait_for(window._drags.empty)

        pull("start", corner)
        pull("update", corner + [0, 0.3, 0])
        wait_for(lambda: np.allclose(cloths.positions[1, 30], corner + [0, 0.3, 0], atol=1e-5))
        assert cloths.step_count[0] > 1  # a drag steps, also without play
        pull("end", corner)
        before = int(cloths.step_count[0])
        window.ask_step(40)
        wait_for(lambda: cloths.step_count[0] >= before + 40)
        assert cloths.positions[1, 30, 1] < 0.2
        time.sleep(0.1)
        assert cloths.step_count[0] <= before + 42  # and stops


def test_who_waits_is_told_that_the_session_has_gone(client, free_port, capsys):
    """By an error, and by `python -m drape.viewer` with a status, for scripts."""
    session = client.session()
    session.create(sheet())
    with client.session(name=session.name) as other:
        window = Window([other.attach()], advance=None, port=free_port)
        session.close()
        with pytest.raises(drape.SessionLost):
            window.run()
    session = client.session()
    session.create(sheet())
    threading.Timer(1.0, session.close).start()
    assert main([f"--server={client.address}", f"--session={session.name}", f"--port={free_port}"]) == 1
    told = capsys.readouterr()
    assert "look at http" in told.out and "SESSION_NOT_FOUND" in told.err


def test_what_the_callers_functions_raise_ends_the_window(session, free_port):
    def broken(*_):
        raise KeyError("steering")

    for functions, ask in (({"advance": broken}, "ask_step"), ({"reset": broken}, "ask_reset")):
        with Window([session.create(sheet())], port=free_port, **functions) as window:
            threading.Timer(0.2, getattr(window, ask)).start()
            with pytest.raises(KeyError, match="steering"):
                window.run()
            assert "KeyError" in window.status.content


@pytest.mark.parametrize("functions, words", [
    ({"advance": 3}, "advance: 3 is neither a function nor None nor 'step'"),
    ({"advance": "stepp"}, "advance: 'stepp' is neither"), ({"reset": 3}, "reset: 3 is neither a function nor None$")])
def test_what_is_no_function_is_refused(session, free_port, functions, words):
    with pytest.raises(drape.InvalidArgument, match=words):
        Window([session.create(sheet())], port=free_port, **functions)


def test_a_spectator_sees_what_somebody_else_steps(client, session, free_port):
    cloths = session.create(sheet(), count=2)
    with client.session(name=session.name) as other, Window([other.attach()], advance=None, port=free_port) as window:
        cloths.step(7)
        wait_for(lambda: "step 7," in window.status.content)
        assert window.play.disabled
        wait_for(lambda: np.array_equal(window._drawings[0]._surface.vertices, cloths.positions.reshape(-1, 3)))


def test_a_spectator_sees_faults_come_and_go(client, session, free_port):
    def pair(stiffness):
        return drape.ClothSpec(settings=drape.StepSettings(substeps=1, time_step_s=0.001), particles=drape.Particles(
            positions_m=[0, 0, 0, 1.01, 0, 0], masses_kg=[1, 1],
            springs=[drape.Spring(i=0, j=1, rest_length_m=1, stiffness_n_per_m=stiffness)]))

    cloths = session.create(pair(1), count=3)
    with client.session(name=session.name) as other, Window([other.attach()], advance=None, port=free_port) as window:
        cloths.update(pair(5e7), "particles.springs", ids=[1])  # far beyond what is stable
        cloths.step(20)
        assert cloths.faulted.tolist() == [False, True, False]
        wait_for(lambda: "**1 faulted**" in window.status.content)
        cloths.reset([1])
        wait_for(lambda: "faulted" not in window.status.content)


def test_what_is_public_says_what_it_does():
    public = [member for name, member in vars(Window).items() if not name.startswith("_")]
    assert public and all(member.__doc__ for member in public)


def test_moving_colliders_are_where_the_server_has_them(client, free_port):
    with client.session() as session:
        scene = drape.scene.load(ROOT / "client/examples/moving_colliders.json")
        player = scene.play(session)
        with Window(player.cloths, advance=player.advance, reset=player.reset, tracks_colliders=True,
                    port=free_port) as window:
            window.ask_step(30)
            wait_for(lambda: "step 30," in window.status.content)
            for cloths, drawing in zip(player.cloths, window._drawings):
                poses = cloths.describe(0).collider_poses
                assert len(poses) == len(drawing._colliders.places) > 0
                for index, _, batch in drawing._colliders.places:
                    assert np.allclose(batch.batched_positions[0], poses[index].position_m, atol=1e-6)


def test_the_cloths_of_a_world_are_stepped_together(session, free_port):
    batches = [session.create(sheet(side, self_collision=drape.v1.SelfCollision()), world="pile") for side in (6, 5)]
    with Window(batches, port=free_port) as window:
        window.ask_step(2)
        wait_for(lambda: [int(cloths.step_count[0]) for cloths in batches] == [2, 2])
        assert "WORLD" not in window.status.content


def test_the_window_says_why_cloths_cannot_be_pulled(session, free_port):
    plain, held = session.create(sheet()), session.create(sheet(max_grips=2))
    loose = session.create(drape.ClothSpec(particles=drape.Particles(positions_m=[0, 0, 0], masses_kg=[1.0])))
    for batches, advance, words in (
            ([held], "step", "shift and the left button pull"), ([plain], "step", "max_grips"),
            ([plain, held], "step", "Some cloths cannot"), ([loose], "step", "no triangles"), ([held], None, "--step")):
        with Window(batches, advance=advance, port=free_port) as window:
            assert words in window.pulling.content, window.pulling.content


def test_a_drag_of_a_cloth_without_grips_does_nothing(session, free_port):
    plain, held = session.create(sheet(5)), session.create(sheet(5, max_grips=3), origins=[[2, 0, 0]])
    both = session.attach([*plain.ids, *held.ids])
    with Window([both], port=free_port) as window:
        drawing = window._drawings[0]
        assert (drawing.grip_of(0), drawing.grip_of(1)) == (None, 2)
        for phase in ("start", "update", "end"):
            window._drags.put((drawing, phase, np.array([0.5, 0, 0.5]), np.array([0.5, 0.2, 0.5])))
            wait_for(window._drags.empty)
        assert window._pulled is None and "**" not in window.status.content
        window._drags.put((drawing, "start", np.array([2.5, 0, 0.5]), np.array([2.5, 0, 0.5])))
        wait_for(lambda: window._pulled is not None and window._pulled[1:] == (1, 2))


@pytest.fixture(scope="module")
def tenants(tmp_path_factory):
    """A server that wants a token and a certificate of whoever comes: its address, and flags that satisfy it."""
    folder = tmp_path_factory.mktemp("tenants")
    certificate, key = certificate_of(folder, "alice")
    (folder / "tokens").write_text(f"a {hashlib.sha256(b'abc').hexdigest()}\n")
    (folder / "token").write_text("abc\n")
    server = drape.private_server.PrivateServer("cpu", flags=[
        f"--tls-cert={certificate}", f"--tls-key={key}", f"--tls-client-ca={certificate}", f"--token-file={folder / 'tokens'}"])
    yield server.address, [f"--tls-ca={certificate}", f"--tls-cert={certificate}", f"--tls-key={key}"], folder / "token"
    server.stop()


@pytest.mark.parametrize("where", ["file", "environment"])
def test_the_command_line_attaches_to_a_server_with_tenants(tenants, free_port, monkeypatch, capsys, where):
    address, tls, token_file = tenants
    certificate, own, key = (flag.partition("=")[2] for flag in tls)
    token = [f"--token-file={token_file}"] if where == "file" else []
    if where == "environment":
        monkeypatch.setenv("DRAPE_TOKEN", "abc")
    ends = queue.SimpleQueue()
    with drape.connect(address, tls=certificate, certificate=(own, key), token="abc") as client, client.session() as session:
        session.create(sheet())
        arguments = [f"--server={address}", f"--session={session.name}", f"--port={free_port}", *tls, *token]
        threading.Thread(target=lambda: ends.put(main(arguments)), daemon=True).start()
        shown = ""
        end = time.monotonic() + 30
        while "look at http" not in shown:
            assert ends.empty() and time.monotonic() < end, capsys.readouterr()
            time.sleep(0.01)
            shown += capsys.readouterr().out
    assert ends.get(timeout=30) == 1, "the session is gone, so the window ends"


@pytest.mark.parametrize("flags, words", [(3, "INVALID_TOKEN"), (1, "CANNOT_CONNECT")])
def test_the_command_line_says_what_a_server_with_tenants_wants(tenants, monkeypatch, capsys, flags, words):
    address, tls, _ = tenants
    monkeypatch.delenv("DRAPE_TOKEN", raising=False)
    assert main([f"--server={address}", "--session=x", *tls[:flags]]) == 1
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("change, words", [
    ({"batches": []}, "batches: [] is not a list of Cloths"),
    ({"batches": None}, "batches: None is not"),
    ({"stride": 0}, "stride: 0 is not a whole number in [1, "),
    ({"time_step_s": 0}, "time_step_s: 0 is not"),
    ({"port": -5}, "port: -5 is not a whole number in [1, 65535]"),
    ({"port": 99999}, "port: 99999 is not"),
    ({"host": "192.0.2.1"}, "host: '192.0.2.1' is no address of this machine"),
    ({"host": "no such host"}, "host: 'no such host' is no address"),
])
def test_a_window_that_cannot_be_is_refused_before_a_server_starts(session, change, words):
    before = threading.active_count()
    with pytest.raises(drape.InvalidArgument) as caught:
        Window(**{"batches": [session.create(sheet())], **change})
    assert words in str(caught.value)
    assert threading.active_count() <= before


def test_the_command_line_says_what_is_wrong(capsys, tmp_path):
    assert main(["/nowhere.json", "--backend=cpu"]) == 1
    assert "NO_SCENE_FILE" in capsys.readouterr().err
    (tmp_path / "empty").touch()
    for path, words in ((tmp_path / "none", "cannot be read"), (tmp_path / "empty", "has no token")):
        assert main(["--server=127.0.0.1:1", "--session=x", f"--token-file={path}"]) == 1
        assert words in capsys.readouterr().err
    for arguments in (["--session=x"], ["x.json", "--tls"], ["x.json", f"--token-file={tmp_path / 'empty'}"],
                      ["--server=127.0.0.1:1", "--session=x", "--tls-cert=x"]):
        with pytest.raises(SystemExit):
            main(arguments)
