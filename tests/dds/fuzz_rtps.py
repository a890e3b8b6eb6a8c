# SPDX-License-Identifier: MIT
"""Send an appliance RTPS packets that are nearly right: what peers on this host sent it, changed.

Listens on the interface to what goes to the appliance, for some seconds and until SIGUSR1, prints
"learned", then sends changed copies for some seconds, always the same for a seed and what was
learned.
"""

from __future__ import annotations

import argparse
import random
import signal
import socket
import struct
import time

MAGIC = b"RTPS"
EDGES = [0, 1, 2, 3, 4, 7, 8, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF]
MOST = 600


def udp_of(frame: bytes) -> tuple[str, int, bytes] | None:
    """Destination and payload of an unfragmented UDP packet of IPv4 in an Ethernet frame."""
    if len(frame) < 42 or frame[12:14] != b"\x08\x00" or frame[23] != 17:
        return None
    at = 14 + 4 * (frame[14] & 15)
    port, length = struct.unpack_from("!HH", frame, at + 2)
    return socket.inet_ntoa(frame[30:34]), port, frame[at + 8 : at + length]


def learn(interface: str, host: str, seconds: float) -> list[tuple[int, bytes]]:
    """Port and payload of what went to @host or to a group, one of each kind and length."""
    told: list[int] = []
    signal.signal(signal.SIGUSR1, lambda number, _: told.append(number))
    print("listening", flush=True)
    seen: dict[tuple[int, int, bytes], tuple[int, bytes]] = {}
    listener = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    listener.bind((interface, 0))
    listener.settimeout(0.1)
    end = time.monotonic() + seconds
    while time.monotonic() < end or not told:
        try:
            frame, address = listener.recvfrom(65536)
        except TimeoutError:
            continue
        found = udp_of(frame)
        if address[2] != socket.PACKET_OUTGOING or found is None or found[2][:4] != MAGIC:
            continue
        to, port, payload = found
        if len(seen) < MOST and (to == host or to.startswith("239.")):
            seen[port, len(payload), payload[20:21]] = (port, payload)
    listener.close()
    return list(seen.values())


def submessages(packet: bytes) -> list[int]:
    """Where they start."""
    found, at = [], 20
    while at + 4 <= len(packet):
        found.append(at)
        order = "<H" if packet[at + 1] & 1 else ">H"
        length = struct.unpack_from(order, packet, at + 2)[0]
        if length == 0:
            break
        at += 4 + length
    return found


def change(rng: random.Random, packet: bytes, other: bytes) -> bytes:
    """One change of a kind that parsers trip over."""
    data = bytearray(packet)
    kind = rng.randrange(8)
    at = rng.randrange(20, max(21, len(data)))
    starts = submessages(packet) or [20]
    if kind == 0 and at < len(data):
        data[at] ^= 1 << rng.randrange(8)
    elif kind == 1 and at < len(data):
        data[at] = rng.choice(EDGES) & 0xFF
    elif kind == 2:
        at = min(at & ~3, len(data) - 4)
        struct.pack_into(rng.choice("<>") + "I", data, at, rng.choice(EDGES))
    elif kind == 3:
        del data[rng.randrange(20, len(data)) :]
    elif kind == 4:
        start = rng.choice(starts)
        if start + 4 <= len(data):
            struct.pack_into(rng.choice("<>") + "H", data, start + 2, rng.choice(EDGES) & 0xFFFF)
    elif kind == 5:
        start = rng.choice(starts)
        data[start:start] = other[rng.choice(submessages(other) or [20]) :][:1200]
    elif kind == 6:
        start = rng.choice(starts)
        if start < len(data):
            data[start] = rng.randrange(256)
    else:
        data[at:at] = rng.randbytes(rng.randrange(1, 64))
    return bytes(data[:60000])


def wait_for_the_next_ten() -> None:
    time.sleep(0.003)  # a pace, not a synchronisation


def send(options: argparse.Namespace, learned: list[tuple[int, bytes]]) -> int:
    rng = random.Random(options.seed)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end = time.monotonic() + options.seconds
    sent = 0
    while time.monotonic() < end:
        for _ in range(10):
            port, packet = rng.choice(learned)
            for _ in range(rng.choice((1, 1, 1, 2, 4))):
                packet = change(rng, packet, rng.choice(learned)[1])
                if len(packet) < 24:
                    packet = packet.ljust(24, b"\0")
            out.sendto(packet, (options.host, port))
            sent += 1
        wait_for_the_next_ten()
    return sent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--interface", required=True)
    parser.add_argument("--host", required=True)
    parser.add_argument("--learn", type=float, default=5)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    learned = learn(options.interface, options.host, options.learn)
    print(f"learned {len(learned)} packets", flush=True)
    if learned:
        print(f"sent {send(options, learned)} packets, seed {options.seed}", flush=True)


if __name__ == "__main__":
    main()
