"""`python -m drape.viewer SCENE.json` serves its page, and ends when it is interrupted."""

import signal
import subprocess
import sys
import urllib.request

# What a shell starts in the background ignores it, and would hand that down.
signal.signal(signal.SIGINT, signal.default_int_handler)
viewer = subprocess.Popen([sys.executable, "-m", "drape.viewer", "/root/examples/hanging_two_corners.json"], stdout=subprocess.PIPE,
                          text=True)
try:
    url = next(line for line in viewer.stdout if line.startswith("look at ")).split()[-1]
    with urllib.request.urlopen(url, timeout=60) as answer:
        page = answer.read()
    assert b"<html" in page
    viewer.send_signal(signal.SIGINT)
    assert viewer.wait(60) == 0
finally:
    viewer.kill()
print(f"viewer: a page of {len(page)} bytes")
