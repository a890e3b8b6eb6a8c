# SPDX-License-Identifier: MIT
"""Members of the group who ask the admin socket for more than it can do."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable
from pathlib import Path

from segment import Segment, Undisturbed, wait_for

# These measure time, or need a cycle in time.
IDLE = True
CLIENTS, OUTSTANDING = 12, 16
ROUNDS, CYCLES = 6, 2000
MAGIC, REGISTER_READ, AL_STATUS = 0x32614445, 12, 0x0130
# app/core/base/admin_protocol.h
REQUEST_BYTES, REPLY_BYTES, ADDRESS_AT = 136 + 64 * 72 + 1024, 56 + 256 + 1024, 28


def register_read(number: int) -> bytes:
    request = bytearray(REQUEST_BYTES)
    struct.pack_into("<III", request, 0, MAGIC, REGISTER_READ, number)
    struct.pack_into("<II", request, ADDRESS_AT, AL_STATUS, 1)
    return bytes(request)


class Flood:
    """A client that always has as many requests out as the socket takes."""

    def __init__(self, path: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(str(path))
        self.socket.setblocking(False)
        self.number = 0
        self.answers = 0
        self.read = 0

    def go_on(self) -> None:
        try:
            while self.number - self.answers < OUTSTANDING:
                self.socket.send(register_read(self.number))
                self.number += 1
        except BlockingIOError:
            pass
        try:
            while True:
                answer = self.socket.recv(REPLY_BYTES)
                assert len(answer) == REPLY_BYTES
                self.answers += 1
                self.read += struct.unpack_from("<i", answer, 12)[0] == 0
        except BlockingIOError:
            pass


def test_a_flood_of_requests_for_frames_delays_neither_supervision_nor_others(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_sim()
    segment.start_daemon()
    segment.wait_for_op()
    clients = [Flood(segment.run_dir / "admin") for _ in range(CLIENTS)]
    undisturbed = Undisturbed(segment)

    def heartbeats_of_a_flood() -> float:
        """Per thousand cycles; each client has an answer in that time."""
        before = segment.status()
        read = [client.read for client in clients]

        def flooded() -> bool:
            for client in clients:
                client.go_on()
            served = all(c.read > n for c, n in zip(clients, read, strict=True))
            return served and segment.status()["cycles"] >= before["cycles"] + CYCLES

        wait_for(f"{CYCLES} cycles and an answer for each client", flooded, 120)
        after = segment.status()
        cycles = after["cycles"] - before["cycles"]
        return (after["heartbeat"] - before["heartbeat"]) * 1000 / cycles

    # The service thread counts ten a second; without turns it came to two, in each round. Less than
    # ten may also come from a machine that does not run it, which passes.
    assert any(heartbeats_of_a_flood() >= 5 for _ in range(ROUNDS))
    assert segment.ecdaq("reg", "read", "0", "0x0130").stdout == "0x0008 8\n"
    for client in clients:
        client.socket.close()
    undisturbed.check()
