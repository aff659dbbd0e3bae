"""A headless Chromium of this machine (Debian's package), driven by its DevTools protocol."""

import base64
import io
import json
import shutil
import subprocess
import time

import numpy as np
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

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(30)


def wait_for(condition, facts=None):
    """`facts` are told if it does not become true."""
    end = time.monotonic() + _WAIT_S
    while not condition():
        assert time.monotonic() < end, facts
        time.sleep(0.05)
