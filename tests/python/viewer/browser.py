"""A headless Chromium of this machine (Debian's package), driven by its DevTools protocol."""

import base64
import io
import json
import shutil
import subprocess
import time

import numpy as np
from drape.viewer.shapes import rotation_of
from PIL import Image
from websockets.sync.client import connect

_PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
_WAIT_S = 120.0  # software rendering on a busy machine
_SHIFT = 8  # of `modifiers`


class Browser:
    """One page of width x height pixels. Coordinates of the mouse are those of its pictures."""

    def __init__(self, folder, width=800, height=600):
        program = next(filter(None, map(shutil.which, _PROGRAMS)), None)
        assert program, f"none of {', '.join(_PROGRAMS)} is installed"
        # Software rendering, wherever the test runs. Its sandbox does not work as root.
        self._process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", "--no-first-run", "--hide-scrollbars", "--remote-debugging-port=0",
             f"--user-data-dir={folder}", f"--window-size={width},{height}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            port_file = folder / "DevToolsActivePort"
            wait_for(lambda: port_file.exists() and port_file.read_text().count("\n") == 1)
            port, path = port_file.read_text().split("\n")
            self._socket = connect(f"ws://127.0.0.1:{port}{path}", max_size=None)
            self._last, self._session = 0, None
            target = next(one for one in self.ask("Target.getTargets")["targetInfos"] if one["type"] == "page")
            self._session = self.ask("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
            self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        except BaseException:
            self._process.kill()
            raise

    def ask(self, method, **parameters):
        """One command, and its result. Events are left aside."""
        self._last += 1
        message = {"id": self._last, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=_WAIT_S))
            if answer.get("id") == self._last:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def open(self, url):
        self.ask("Page.navigate", url=url)
        wait_for(lambda: self.run("location.href + document.readyState").startswith(url) and
                 self.run("document.readyState") == "complete")

    def run(self, expression):
        """The value of a JavaScript expression."""
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def picture(self):
        """uint8[height, width, 3]."""
        data = base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def mouse(self, kind, at, shift=False, holds=False):
        """kind: "mousePressed", "mouseMoved" or "mouseReleased", with the left button. holds: it is down while moved."""
        self.ask("Input.dispatchMouseEvent", type=kind, x=float(at[0]), y=float(at[1]), modifiers=_SHIFT if shift else 0,
                 button="left" if kind != "mouseMoved" or holds else "none", buttons=int(kind == "mousePressed" or holds),
                 clickCount=0 if kind == "mouseMoved" else 1)

    def click(self, at):
        self.mouse("mousePressed", at)
        self.mouse("mouseReleased", at)

    def press(self, key, code):
        """A key by its name and number, e.g. "Enter", 13."""
        for kind in ("rawKeyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def places(self, selector):
        """[x, y, width, height] of every element that is shown, from top to bottom, and its text."""
        found = self.run(f"""[...document.querySelectorAll({json.dumps(selector)})].map(one => {{
            const box = one.getBoundingClientRect(); return [[box.x, box.y, box.width, box.height], one.innerText]; }})""")
        return sorted((one for one in found if one[0][2] and one[0][3]), key=lambda one: one[0][1])

    def beside(self, text, selector):
        """The middles of the elements on the line of the label of this text, from left to right."""
        ((_, line, _, high),) = [box for box, own in self.places("label") if own == text]
        middles = [middle(box) for box, _ in self.places(selector)]
        return sorted(one for one in middles if abs(one[1] - line - high / 2) < 12)

    def press_button(self, text):
        """Clicks on the button of this text, or on the box to tick beside it."""
        buttons = [box for box, own in self.places("button") if own == text]
        self.click(middle(buttons[0]) if buttons else self.beside(text, "input[type=checkbox]")[0])

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(30)


def middle(box):
    x, y, width, height = box
    return x + width / 2, y + height / 2


def on_screen(window, points, width, height):
    """Pixels [n, 2] of points [n, 3], by the camera that the browser says it has."""
    (client,) = window.server.get_clients().values()
    w, x, y, z = client.camera.wxyz
    seen = (points - client.camera.position) @ rotation_of([x, y, z, w])  # x right, y down, z ahead
    focal = height / 2 / np.tan(client.camera.fov / 2)
    return seen[:, :2] / seen[:, 2:] * focal + [width / 2, height / 2]


def wait_for(condition, facts=None):
    """`facts` are told if it does not become true."""
    end = time.monotonic() + _WAIT_S
    while not condition():
        assert time.monotonic() < end, facts
        time.sleep(0.05)
