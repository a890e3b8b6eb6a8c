# SPDX-License-Identifier: MIT
"""ping.py ADDRESS COUNT BYTES SECONDS: echo requests, each after the answer to the one before it,
or after SECONDS; prints the number of answers with the same bytes. Runs in the namespace of the
master."""

from __future__ import annotations

import socket
import struct
import sys
import time


def checksum(data: bytes) -> int:
    total = sum(struct.unpack(f">{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def request(number: int, size: int) -> bytes:
    body = bytes((number + i) % 256 for i in range(size))
    head = struct.pack(">BBHHH", 8, 0, 0, 0x6563, number)
    return struct.pack(">BBHHH", 8, 0, checksum(head + body), 0x6563, number) + body


def is_answered(sock: socket.socket, sent: bytes, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        sock.settimeout(max(end - time.monotonic(), 0.001))
        try:
            packet = sock.recv(2048)
        except TimeoutError:
            return False
        answer = packet[(packet[0] & 15) * 4 :]
        if answer[0] == 0 and answer[4:] == sent[4:]:
            return checksum(answer) == 0
    return False


def main() -> int:
    address, count, size = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    seconds = float(sys.argv[4])
    answers = 0
    with socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP) as sock:
        for number in range(count):
            sent = request(number, size)
            try:
                sock.sendto(sent, (address, 0))
            except OSError:
                continue  # nobody has answered by ARP
            answers += is_answered(sock, sent, seconds)
    print(answers)
    return 0


if __name__ == "__main__":
    sys.exit(main())
