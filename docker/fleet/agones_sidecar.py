"""Tells Agones how its draped is: ready once /readyz says so, alive as long as /healthz does, and how many sessions it has.

Runs beside draped in its pod (agones.yaml). Only the standard library. AGONES_SDK_HTTP_PORT is set by Agones; DRAPE_METRICS
is the address of --metrics-listen.
"""

import json
import os
import re
import sys
import time
import urllib.error
import urllib.request

PERIOD_S = 2.0
TIMEOUT_S = 2.0


def ask(url, method="GET", message=None):
    """The answer, or None where there is none, or no good one."""
    data = None if message is None else json.dumps(message).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"}, method=method)
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT_S) as answer:
            return answer.read().decode()
    except (urllib.error.URLError, OSError):
        return None


def sessions_in(metrics):
    found = re.search(r"^drape_sessions (\d+)$", metrics or "", re.MULTILINE)
    return None if found is None else int(found.group(1))


class Sidecar:
    def __init__(self, server, agones):
        self.server = server
        self.agones = agones
        self.is_ready = False
        self.sessions = None

    def look(self):
        """Once. Agones is told of life each time, of readiness once, and of sessions when their number changes."""
        if ask(f"{self.server}/healthz") is None:
            return  # Agones counts the missing sign of life
        ask(f"{self.agones}/health", "POST", {})
        if not self.is_ready and ask(f"{self.server}/readyz") is not None:
            self.is_ready = ask(f"{self.agones}/ready", "POST", {}) is not None
        sessions = sessions_in(ask(f"{self.server}/metrics"))
        if sessions is not None and sessions != self.sessions:
            if ask(f"{self.agones}/v1beta1/counters/sessions", "PATCH", {"count": str(sessions)}) is not None:
                self.sessions = sessions


def main():
    sidecar = Sidecar(f"http://{os.environ.get('DRAPE_METRICS', '127.0.0.1:7744')}",
                      f"http://localhost:{os.environ.get('AGONES_SDK_HTTP_PORT', '9358')}")
    print(f"watching {sidecar.server} for {sidecar.agones}", file=sys.stderr, flush=True)
    while True:
        sidecar.look()
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    main()
