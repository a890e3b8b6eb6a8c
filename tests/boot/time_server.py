# SPDX-License-Identifier: MIT
"""A time server for the machine: answers NTP (RFC 5905, client and server) with the host's clock.

time_server.py ADDRESS; prints "ready" when it listens, ends when its standard input does.
"""

from __future__ import annotations

import select
import socket
import struct
import sys
import time

PORT = 123
EPOCH_1970_S = 2208988800
VERSION_4_SERVER = 0x24
STRATUM = 1
POLL_LOG2_S = 4
PRECISION_LOG2_S = -20
DISPERSION = 1 << 6  # 2^-16 s each: about 1 ms
FORMAT = "!BBbbII4sQQQQ"


def ntp_now() -> int:
    """The host's time as NTP has it: seconds since 1900, and 2^-32 parts of one."""
    return int((time.time_ns() / 1e9 + EPOCH_1970_S) * 2**32)


def answer(request: bytes, received: int) -> bytes | None:
    """The reply to a client's request; None for what is not one."""
    if len(request) < struct.calcsize(FORMAT) or request[0] & 7 != 3:
        return None
    originate = struct.unpack_from("!Q", request, 40)[0]
    head = (VERSION_4_SERVER, STRATUM, POLL_LOG2_S, PRECISION_LOG2_S, 0, DISPERSION, b"PC\0\0")
    return struct.pack(FORMAT, *head, received, originate, received, ntp_now())


def main() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind((sys.argv[1], PORT))
        print("ready", flush=True)
        while True:
            ready, _, _ = select.select([port, sys.stdin], [], [])
            if sys.stdin in ready:
                return
            request, peer = port.recvfrom(512)
            reply = answer(request, ntp_now())
            if reply is not None:
                port.sendto(reply, peer)


if __name__ == "__main__":
    main()
