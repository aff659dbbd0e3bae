"""The window: a viser server, its controls, and the loop that steps and shows."""

from __future__ import annotations

import pathlib
import queue
import reprlib
import socket
import threading
import time

import numpy as np
import viser

import drape
from drape import checks, errors
from drape.viewer.drawing import Drawing
from drape.viewer.pace import Pace
from drape.viewer.surroundings import Surroundings

_FRAME_S = 1 / 30
_LOOK_AGAIN_S = 1.0  # whether somebody else has changed gravity or wind; whether what somebody else steps has blown up
_COLOURINGS = ("cloth", "strain", "speed")


def _checked(batches):
    """A list of `batches`, at least one."""
    if not isinstance(batches, (list, tuple)) or not batches or not all(isinstance(of, drape.Cloths) for of in batches):
        raise errors.bad_field("batches", f"{reprlib.repr(batches)} is not a list of Cloths, at least one")
    return list(batches)


def _check_function(name, given, *others):
    if not callable(given) and not any(given is other for other in others):
        raise errors.bad_field(name, f"{reprlib.repr(given)} is neither a function nor {' nor '.join(map(repr, others))}")


def _check_place(host, port):
    """viser waits for ever for a server that cannot listen."""
    checks.whole("port", port, 1, 2**16 - 1)
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
            probe.bind((host, 0))
    except (OSError, TypeError) as error:
        raise errors.bad_field("host", f"{host!r} is no address of this machine, as 127.0.0.1 and 0.0.0.0 are: {error}") from None


class Window:
    """Batches of cloths in a browser, at most 30 pictures a second. Shift and the left button pull cloths with
    `max_grips`. Gravity and wind are the cloths' own until they are moved here.

    batches: a list of `Cloths`. advance(steps): steps them all (default: all of a session in one request, as the cloths
    of a world must be); None: somebody else does. reset(): begins again. time_step_s: of the simulation, for playing in
    real time. stride: shows every so manieth cloth only, for slow networks. host: "0.0.0.0" lets other machines look on.
    tracks_colliders: others move them, or change pins: asks the server after every step. `with` and `close()` end it;
    `run()` blocks. Raises InvalidArgument, also if no server can listen on this host.
    """

    def __init__(self, batches, *, advance="step", reset=None, time_step_s=1 / 60, stride=1, host="127.0.0.1", port=8080,
                 tracks_colliders=False):
        self.batches = _checked(batches)
        checks.whole("stride", stride, 1, 2**31 - 1)
        checks.positive("time_step_s", time_step_s)
        _check_function("advance", advance if advance != "step" else self._step_all, None, "step")
        _check_function("reset", reset, None)
        _check_place(host, port)
        self._advance = self._step_all if advance == "step" else advance
        self._reset = self._reset_all if reset is None else reset
        self._time_step_s = time_step_s
        self._lock = threading.Lock()
        self._steps_asked = 0
        self._is_reset_asked = False
        self._closing = threading.Event()
        self._error = None  # what ended the loop
        self._is_run = False  # somebody waits, and is told of it
        self._drags = queue.SimpleQueue()
        self._pulled = None  # (drawing, row, slot) while a cloth is dragged
        self._recording = None
        self._recorded = None  # a file that waits to be written
        self.server = viser.ViserServer(host=host, port=port, verbose=False)
        self.server.scene.set_up_direction("+y")
        self._drawings = [Drawing(self.server.scene, f"/batch_{k}", cloths, stride)
                          for k, cloths in enumerate(self.batches)]
        for drawing in self._drawings:
            if advance is not None:
                drawing.on_drag(lambda *drag: self._drags.put(drag))
            if tracks_colliders:
                drawing.track()
        self._place_camera()
        self._add_controls()
        self._thread = threading.Thread(target=self._loop, name="drape-viewer", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Where a browser of this machine finds the window: "http://HOST:PORT". PORT is another one than was asked for, if
        that was taken."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    def run(self) -> None:
        """Until Ctrl-C, or `close()`. Raises what ends it before: SessionLost and Unavailable where the cloths are gone, and
        what `advance` and `reset` raise that is no error of this package: those are shown, and it goes on."""
        self._is_run = True
        try:
            while self._thread.is_alive():
                self._thread.join(0.2)
        finally:
            self.close()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Ends the window, not the cloths. May be called again."""
        if self._closing.is_set():
            return
        self._closing.set()
        self._thread.join(5)
        self.server.stop()

    def start_recording(self) -> None:
        """Records every picture from now on. Forgets a recording that was not saved."""
        with self._lock:
            self._recording, self._recorded = self.server.get_scene_serializer(), None

    def save_recording(self, path) -> None:
        """Ends the recording and writes it as one HTML file that plays it back. Raises FailedPrecondition (NOT_RECORDING),
        and OSError if the file cannot be written: the recording is kept then, to be saved elsewhere."""
        file = self._end_recording()
        if file is None:
            raise errors.FailedPrecondition("nothing is being recorded: start_recording() comes first",
                                            reason="NOT_RECORDING")
        pathlib.Path(path).write_text(file)
        self._recorded = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    # --- controls

    def _add_controls(self):
        gui = self.server.gui
        self.play = gui.add_checkbox("play", initial_value=False, disabled=self._advance is None)
        step = gui.add_button("step", disabled=self._advance is None)
        reset = gui.add_button("reset", disabled=self._advance is None)
        self.colouring = gui.add_dropdown("colour by", [name for name in _COLOURINGS if self._can_colour(name)])
        self.surroundings = Surroundings(gui, self.batches)
        self.pulling = gui.add_markdown(self._how_to_pull())
        self.status = gui.add_markdown("")
        record = gui.add_button("record")
        step.on_click(lambda _: self.ask_step())
        reset.on_click(lambda _: self.ask_reset())
        record.on_click(lambda event: self._toggle_recording(event, record))

    def ask_step(self, steps: int = 1) -> None:
        """Steps (at least 1) before the next picture. Raises InvalidArgument."""
        asked = checks.whole("steps", steps, 1, 2**31 - 1)
        with self._lock:
            self._steps_asked += asked

    def ask_reset(self) -> None:
        """Begins again before the next picture, by `reset` of the constructor."""
        with self._lock:
            self._is_reset_asked = True

    def _can_colour(self, name):
        return all(drawing.can_colour(name) for drawing in self._drawings)

    def _how_to_pull(self):
        if self._advance is None:
            return ("The cloths cannot be pulled, since somebody else steps them. `python -m drape.viewer --step` steps them "
                    "itself.")
        reasons = [drawing.why_not_pulled() for drawing in self._drawings]
        if not any(reasons):
            return "shift and the left button pull the cloth"
        which = "The" if all(reasons) else "Some"
        return f"{which} cloths cannot be pulled: {', or '.join(sorted(set(filter(None, reasons))))}."

    def _toggle_recording(self, event, button):
        if self._recording is None:
            self.start_recording()
            button.label = "stop and save"
            return
        if event.client is None:
            return  # nobody to send it to: it goes on
        file = self._end_recording()
        button.label = "record"
        event.client.send_file_download("drape.html", file.encode(), save_immediately=True)
        self._recorded = None

    def _end_recording(self):
        """The recording as a file, which is kept until it is written; None if there is none."""
        with self._lock:
            recording, self._recording = self._recording, None
        if recording is not None:
            self._recorded = recording.as_html()
        return self._recorded

    # --- the loop

    def _loop(self):
        owed_s, last, pace = 0.0, time.monotonic(), Pace(_FRAME_S)
        looked = last
        while not self._closing.is_set():
            begin = time.monotonic()
            runs = self.play.value or self._pulled is not None or not self._drags.empty()
            owed_s = min(owed_s + begin - last, 2 * _FRAME_S) if runs else 0.0
            last = begin
            try:
                with self._lock:
                    self.surroundings.apply()
                    steps = self._steps_now(int(owed_s / self._time_step_s))
                    owed_s -= steps * self._time_step_s
                    if begin - looked > _LOOK_AGAIN_S:
                        looked = begin
                        self.surroundings.follow()
                        self._look_for_faults()
                    self._show(steps)
            except errors.Error as error:
                self.status.content = f"**{error}**"
                if isinstance(error, (errors.SessionLost, errors.Unavailable)):
                    self._error = error
                    return
            except BaseException as error:  # of the caller's functions
                self.status.content = f"**{type(error).__name__}: {error}**"
                self._error = error
                if self._is_run:
                    return
                raise
            self._closing.wait(pace.left_s(time.monotonic()))

    def _steps_now(self, playing):
        steps, self._steps_asked = max(playing, 0) + self._steps_asked, 0
        if self._is_reset_asked:
            self._is_reset_asked = False
            self._reset()
            self.surroundings.follow()
            for drawing in self._drawings:
                drawing.describe()
        while not self._drags.empty():
            self._pull(*self._drags.get())
        if steps and self._advance is not None:
            self._advance(steps)
            return steps
        if self._advance is None:
            for cloths in self.batches:
                cloths.read()
        return 0

    def _look_for_faults(self):
        """Answers to own steps tell of them, states that are read do not."""
        if self._advance is None:
            for cloths in self.batches:
                cloths.faulted[:] = [cloth.faulted for cloth in cloths.descriptions()]

    def _pull(self, drawing, phase, start, end):
        """The particle that was nearest when the drag began follows the pointer."""
        cloths = drawing.cloths
        if phase == "start":
            row, particle = drawing.nearest(start)
            slot = drawing.grip_of(row)
            if slot is None:
                return
            cloths.grip(slot, particles=[particle], ids=[row])
            self._pulled = (drawing, row, slot)
        if self._pulled is None:
            return
        _, row, slot = self._pulled
        if phase == "end":
            cloths.release(slot, ids=[row])
            self._pulled = None
            return
        origin = cloths.origins[row] if cloths.origins is not None else 0.0
        cloths.move_grips(slot, end - origin, over_s=_FRAME_S, ids=[row])

    def _show(self, steps):
        begin = time.perf_counter()
        colouring = self.colouring.value  # read once: the browser's thread may change it at any time
        with self.server.atomic():
            tops = [drawing.update(colouring) for drawing in self._drawings]
        if self._recording is not None and steps:
            self._recording.insert_sleep(steps * self._time_step_s)
        first = self.batches[0]
        unit = {"strain": "largest strain {:.3%}", "speed": "largest speed {:.2f} m/s"}.get(colouring, "")
        text = unit.format(max(tops)) if unit else ""
        faulted = sum(int(cloths.faulted.sum()) for cloths in self.batches)
        self.status.content = (f"step {int(first.step_count[0])}, {sum(c.num for c in self.batches)} cloths"
                               + (f", **{faulted} faulted**" if faulted else "") + (f"  \n{text}" if text else "")
                               + f"  \n{1e3 * (time.perf_counter() - begin):.1f} ms per picture here")

    def _step_all(self, steps):
        if len(self.batches) == 1:
            self.batches[0].step(steps)  # its answer brings the positions
            return
        sessions = {id(cloths._session): cloths._session for cloths in self.batches}
        for session in sessions.values():
            session.step([cloths for cloths in self.batches if cloths._session is session], steps)

    def _reset_all(self):
        for cloths in self.batches:
            cloths.reset()

    def _place_camera(self):
        points = np.concatenate([cloths.positions.reshape(-1, 3) for cloths in self.batches])
        low, high = points.min(0), points.max(0)
        middle, size = (low + high) / 2, max(float(np.linalg.norm(high - low)), 0.1)
        camera = self.server.initial_camera
        camera.look_at = tuple(middle)
        camera.position = tuple(middle + size * np.array([0.6, 0.5, 1.1]))
