# SPDX-License-Identifier: MIT
"""A headless Chromium, told what to do by its DevTools protocol."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import signal
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any

from web_client import WebSocket

# Pixels of the first channel's colour on the canvas: in how many columns, highest and lowest row.
SEEN = """(() => {
  const canvas = document.querySelector('#scope-canvas');
  const { width, height } = canvas;
  const copy = Object.assign(document.createElement('canvas'), { width, height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, width, height).data;
  const colour = getComputedStyle(canvas).getPropertyValue('--c0').trim();
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const columns = new Set();
  for (let i = 0; i < data.length; i += 4) {
    if (Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60) {
      columns.add((i / 4) % width);
    }
  }
  return columns.size / width;
})()"""

PROGRAMS = ("chromium-headless-shell", "chromium")


def find() -> str | None:
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


class Browser:
    """One window on one page."""

    def __init__(self, folder: Path, url: str, dark: bool = False, width: int = 1100) -> None:
        program = find()
        assert program is not None
        self.log = folder / "chromium.log"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [
                    program,
                    "--headless",
                    "--no-sandbox",
                    "--disable-gpu",
                    "--remote-debugging-port=0",
                    f"--user-data-dir={folder / 'profile'}",
                    f"--window-size={width},800",
                    "about:blank",
                ],
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self.number = 0
        self.seen: list[dict[str, Any]] = []
        port = self.wait_for_port()
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=20) as answer:
            [target] = [t for t in json.load(answer) if t["type"] == "page"]
        path = re.sub(r"^ws://[^/]+", "", target["webSocketDebuggerUrl"])
        self.socket = WebSocket(port, (), path=path)
        self.tell("Runtime.enable")
        self.tell("Log.enable")
        self.tell("Page.enable")
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.tell("Emulation.setEmulatedMedia", features=scheme)
        self.go(url)

    def wait_for_port(self) -> int:
        end = time.monotonic() + 60
        while True:
            found = re.search(r"listening on ws://127\.0\.0\.1:(\d+)/", self.log.read_text())
            if found:
                return int(found[1])
            assert self.process.poll() is None and time.monotonic() < end, self.log.read_text()
            time.sleep(0.05)

    def tell(self, method: str, **parameters: Any) -> dict[str, Any]:
        self.number += 1
        self.socket.ask(id=self.number, method=method, params=parameters)
        while True:
            message = json.loads(self.socket.recv()[1])
            if message.get("id") == self.number:
                assert "error" not in message, message
                return message["result"]
            self.seen.append(message)

    def go(self, url: str) -> None:
        self.tell("Page.navigate", url=url)
        self.wait_for("document.readyState === 'complete'")

    def value(self, expression: str) -> Any:
        got = self.tell(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in got, got
        return got["result"].get("value")

    def wait_for(self, expression: str, seconds: float = 30) -> Any:
        end = time.monotonic() + seconds
        while not (value := self.value(expression)):
            assert time.monotonic() < end, f"never: {expression}\n{self.problems()}"
            time.sleep(0.05)
        return value

    def text(self, selector: str) -> str:
        return self.value(f"document.querySelector({selector!r}).textContent")

    def problems(self) -> list[dict[str, Any]]:
        """Errors of scripts, and what the browser itself reports, as a broken security policy."""
        kinds = ("Runtime.exceptionThrown", "Log.entryAdded")
        self.value("1")
        return [m["params"] for m in self.seen if m["method"] in kinds]

    def picture(self, path: Path) -> None:
        data = self.tell("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))

    def close(self) -> None:
        # Debian's command is a script; the browser is its child.
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(30)
