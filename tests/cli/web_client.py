# SPDX-License-Identifier: MIT
"""A plain WebSocket client on the standard library, and HTTP requests as they are on the wire."""

from __future__ import annotations

import base64
import json
import os
import socket
import struct
import time
from typing import Any

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
FOXGLOVE = ("foxglove.sdk.v1", "foxglove.websocket.v1")


class RejectedError(Exception):
    """The server did not make it a WebSocket; the first line of its answer."""


def http(
    port: int, request: str, body: str = "", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of the answer to @request ("GET /")."""
    fields = {"Host": f"127.0.0.1:{port}", "Connection": "close"} | headers
    lines = [f"{request} HTTP/1.1", *(f"{k}: {v}" for k, v in fields.items()), "", ""]
    with socket.create_connection(("127.0.0.1", port), timeout=20) as sock:
        sock.sendall(("\r\n".join(lines) + body).encode())
        data = b""
        while part := sock.recv(65536):
            data += part
    head, _, answer = data.partition(b"\r\n\r\n")
    first, *rest = head.decode().split("\r\n")
    fields = {k.lower(): v for k, v in (r.split(": ", 1) for r in rest)}
    return int(first.split()[1]), fields, answer


def unchunk(body: bytes) -> bytes:
    """What a chunked body has; it must be complete."""
    data = b""
    while True:
        head, _, body = body.partition(b"\r\n")
        count = int(head, 16)
        if count == 0:
            assert body == b"\r\n"
            return data
        data += body[:count]
        assert body[count : count + 2] == b"\r\n"
        body = body[count + 2 :]


class WebSocket:
    """One connection; recv() gives (opcode, payload)."""

    def __init__(
        self,
        port: int,
        protocols: tuple[str, ...] = FOXGLOVE,
        receive_bytes: int = 0,
        path: str = "/",
        **headers: str,
    ) -> None:
        self.sock = socket.socket()
        if receive_bytes:
            self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self.sock.settimeout(20)
        self.sock.connect(("127.0.0.1", port))
        fields = {
            "Host": f"127.0.0.1:{port}",
            "Upgrade": "websocket",
            "Connection": "Upgrade",
            "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
            "Sec-WebSocket-Version": "13",
        }
        if protocols:
            fields["Sec-WebSocket-Protocol"] = ", ".join(protocols)
        fields |= headers
        lines = [f"GET {path} HTTP/1.1", *(f"{k}: {v}" for k, v in fields.items()), "", ""]
        self.sock.sendall("\r\n".join(lines).encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            part = self.sock.recv(4096)
            if not part:
                raise RejectedError(self.data.split(b"\r\n")[0].decode())
            self.data += part
        head, _, self.data = self.data.partition(b"\r\n\r\n")
        if b" 101 " not in head.split(b"\r\n")[0]:
            self.sock.close()
            raise RejectedError(head.split(b"\r\n")[0].decode())
        self.head = head.decode()

    def close(self) -> None:
        self.sock.close()

    def _take(self, count: int) -> bytes:
        while len(self.data) < count:
            part = self.sock.recv(1 << 16)
            if not part:
                raise ConnectionError("closed by the server")
            self.data += part
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def frame(self) -> tuple[int, bytes]:
        first, second = self._take(2)
        length = second & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", self._take(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._take(8))
        payload = self._take(length)
        if not first & 0x80:
            _, more = self.frame()
            payload += more
        return first & 0xF, payload

    def recv(self) -> tuple[int, bytes]:
        while True:
            opcode, payload = self.frame()
            if opcode == PING:
                self.send(payload, PONG)
            elif opcode == CLOSE:
                raise ConnectionError(f"closed: {payload[:2].hex()}")
            else:
                return opcode, payload

    def send(self, payload: bytes | str, opcode: int | None = None) -> None:
        data = payload.encode() if isinstance(payload, str) else payload
        opcode = opcode or (TEXT if isinstance(payload, str) else BINARY)
        if len(data) < 126:
            head = struct.pack("BB", 0x80 | opcode, 0x80 | len(data))
        elif len(data) < 1 << 16:
            head = struct.pack(">BBH", 0x80 | opcode, 0xFE, len(data))
        else:
            head = struct.pack(">BBQ", 0x80 | opcode, 0xFF, len(data))
        mask = os.urandom(4)
        self.sock.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def ask(self, **request: Any) -> None:
        self.send(json.dumps(request))


class Viewer(WebSocket):
    """A client of the Foxglove protocol: channels by topic, messages by topic."""

    def __init__(self, port: int, **arguments: Any) -> None:
        super().__init__(port, **arguments)
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.statuses: list[dict[str, Any]] = []
        self.topic_of: dict[int, str] = {}

    def step(self) -> tuple[str, int, bytes] | None:
        """The next message: topic, time, data; None: it was something else."""
        opcode, payload = self.recv()
        if opcode == BINARY:
            kind, subscription, stamp = struct.unpack_from("<BIQ", payload)
            assert kind == 1
            return self.topic_of[subscription], stamp, payload[13:]
        message = json.loads(payload)
        if message["op"] == "serverInfo":
            self.info = message
        elif message["op"] == "advertise":
            self.channels |= {c["topic"]: c for c in message["channels"]}
        elif message["op"] == "unadvertise":
            gone = set(message["channelIds"])
            self.channels = {t: c for t, c in self.channels.items() if c["id"] not in gone}
        elif message["op"] == "status":
            self.statuses.append(message)
        return None

    def wait_for_topics(self, *topics: str, seconds: float = 30) -> None:
        end = time.monotonic() + seconds
        while not all(t in self.channels for t in topics):
            assert time.monotonic() < end, (topics, list(self.channels))
            self.step()

    def subscribe(self, *topics: str) -> None:
        wanted = []
        for topic in topics:
            subscription = 100 + len(self.topic_of)
            self.topic_of[subscription] = topic
            wanted.append({"id": subscription, "channelId": self.channels[topic]["id"]})
        self.ask(op="subscribe", subscriptions=wanted)


class Page(WebSocket):
    """A client of the protocol of our own page: the newest text of each kind, and pictures."""

    def __init__(self, port: int) -> None:
        super().__init__(port, ("ecdaq.page.v1",))
        self.newest: dict[str, dict[str, Any]] = {}
        self.events: list[dict[str, Any]] = []

    def step(self) -> tuple[dict[str, Any], bytes]:
        """The next message; of a picture also what follows its text."""
        opcode, payload = self.recv()
        rest = b""
        if opcode == BINARY:
            (length,) = struct.unpack_from("<I", payload)
            payload, rest = payload[4 : 4 + length], payload[4 + length :]
        message = json.loads(payload)
        self.newest[message["op"]] = message
        if message["op"] == "events":
            self.events += message["events"]
        return message, rest

    def wait_for(self, kind: str, is_wanted: Any = lambda message: True) -> dict[str, Any]:
        end = time.monotonic() + 30
        while True:
            message, _ = self.step()
            if message["op"] == kind and is_wanted(message):
                return message
            assert time.monotonic() < end, (kind, self.newest)

    def draw(self, **request: Any) -> tuple[dict[str, Any], list[list[float]], bytes]:
        """The text, for each channel the values of min then of max, and the marks."""
        wanted = {"cycles": 1000, "pixels": 100, "end": 0, "channels": [0]} | request
        number = self.newest.get("number", {"id": 0})["id"] + 1
        self.newest["number"] = {"id": number}
        self.ask(op="draw", id=number, **wanted)
        while True:
            message, rest = self.step()
            if message.get("id") == number:
                break
        if message["op"] != "picture":
            return message, [], b""
        count = 2 * message["pixels"]
        values = [
            list(struct.unpack_from(f"<{count}f", rest, 4 * count * i))
            for i in range(len(message["channels"]))
        ]
        return message, values, rest[4 * count * len(values) :]
