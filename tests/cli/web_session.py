# SPDX-License-Identifier: MIT
"""ecdaq-web-command beside an ecdaq-web, and log-ins as a browser makes them."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Sequence
from typing import Any

from ecdaq import BIN, ecdaq, works
from recording import Bench, wait_until
from web_bench import SECONDS, Web
from web_client import http

WEB_COMMAND = BIN / "ecdaq-web-command"
ROLES = ("viewer", "operator", "engineer")


class WebCommand:
    """ecdaq-web-command on the run directory of a bench."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.folder = bench.run_dir / "web-command"
        self.process = bench.start(
            WEB_COMMAND, "--run-dir", bench.run_dir, "--set", "web.enable=on"
        )
        wait_until("its sockets", self.listens)

    def listens(self) -> bool:
        assert self.process.poll() is None, self.process.communicate()
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as sock:
            return sock.connect_ex(str(self.folder / "token")) == 0

    def token(self, role: str, *words: str) -> str:
        return works(ecdaq(self.bench.run_dir, "web-token", role, *words)).strip()

    def stop(self) -> str:
        """Its messages."""
        self.process.terminate()
        _, errors = self.process.communicate(timeout=SECONDS)
        assert self.process.returncode == 0, errors
        return errors


def post(web: Web, path: str, body: str, **headers: str) -> tuple[int, dict[str, str], str]:
    """As the page of this server posts it, but for @headers."""
    own = {
        "Origin": f"http://127.0.0.1:{web.port}",
        "Content-Length": str(len(body.encode())),
    } | headers
    fields = {name: value for name, value in own.items() if value}
    status, answer, text = http(web.port, f"POST {path}", body=body, **fields)
    return status, answer, text.decode()


class Session:
    """Somebody who has logged in."""

    def __init__(self, web: Web, token: str) -> None:
        self.web = web
        status, headers, text = post(web, "/login", token)
        assert status == 200, text
        self.attributes = headers["set-cookie"].split("; ")
        self.cookie = self.attributes[0]
        answer: dict[str, Any] = json.loads(text)
        self.role, self.secret = answer["role"], answer["secret"]

    def ask(self, *words: str, path: str = "/command", **headers: str) -> tuple[int, str]:
        fields = {"Cookie": self.cookie} | headers
        status, _, text = post(self.web, path, "\n".join([self.secret, *words]), **fields)
        return status, text


def expect_by_role(
    role: str,
    commands: Sequence[tuple[str, tuple[str, ...]]],
    ask: Callable[..., tuple[int, str]],
) -> None:
    """Of the commands, those that need @role or less are done, the others refused."""
    for needed, words in commands:
        status, text = ask(*words)
        is_allowed = ROLES.index(role) >= ROLES.index(needed)
        assert (status == 200) == is_allowed, (words, status, text)
        if not is_allowed:
            assert (status, text) == (403, "the role of this log-in may not do that\n")
