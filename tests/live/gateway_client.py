# SPDX-License-Identifier: MIT
"""A client of the mailbox gateway, from the text of ETG.8200 and ETG.1000.6, on its own.

It runs as a process of its own, in the network namespace of the master:
gateway_client.py udp|tcp STATION COMMAND [ARGUMENT...]; prints one line of JSON.
"""

from __future__ import annotations

import json
import socket
import struct
import sys
from collections.abc import Callable

PORT = 34980
EOE, COE, FOE = 2, 3, 4
FOE_HEADER = 6
SDO_REQUEST, SDO_RESPONSE = 2, 3


class RefusedError(Exception):
    """An error reply of the mailbox: its detail."""


class Gateway:
    """One connection, or one UDP socket, to one slave."""

    def __init__(self, kind: str, station: int, seconds: float = 10) -> None:
        self.station = station
        self.counter = 0
        self.is_tcp = kind == "tcp"
        self.socket = socket.socket(
            socket.AF_INET, socket.SOCK_STREAM if self.is_tcp else socket.SOCK_DGRAM
        )
        self.socket.settimeout(seconds)
        self.socket.connect(("127.0.0.1", PORT))

    def send(self, protocol: int, data: bytes) -> None:
        self.counter = self.counter % 7 + 1
        mail = struct.pack("<HHBB", len(data), self.station, 0, protocol | self.counter << 4)
        self.socket.sendall(struct.pack("<H", len(mail) + len(data) | 5 << 12) + mail + data)

    def read_exactly(self, length: int) -> bytes:
        got = b""
        while len(got) < length:
            part = self.socket.recv(length - len(got))
            if not part:
                raise ConnectionError("closed by the gateway")
            got += part
        return got

    def receive(self) -> tuple[int, bytes]:
        if self.is_tcp:
            head = self.read_exactly(2)
            frame = head + self.read_exactly(struct.unpack("<H", head)[0] & 0x7FF)
        else:
            frame = self.socket.recv(2048)
        header, length, station, _, kind = struct.unpack("<HHHBB", frame[:8])
        assert header >> 12 == 5
        assert header & 0x7FF == len(frame) - 2
        assert length == len(frame) - 8
        assert station == self.station
        assert kind >> 4 == self.counter, "the counter of the request"
        if kind & 15 == 0:
            raise RefusedError(struct.unpack("<HH", frame[8:12])[1])
        return kind & 15, frame[8:]

    def exchange(self, protocol: int, data: bytes) -> bytes:
        self.send(protocol, data)
        kind, answer = self.receive()
        assert kind == protocol
        return answer


# --- SDO


def sdo(gateway: Gateway, body: bytes) -> bytes:
    answer = gateway.exchange(COE, struct.pack("<H", SDO_REQUEST << 12) + body.ljust(8, b"\0"))
    assert struct.unpack("<H", answer[:2])[0] >> 12 in (SDO_REQUEST, SDO_RESPONSE)
    if answer[2] >> 5 == 4:
        raise RefusedError(struct.unpack("<I", answer[6:10])[0])
    return answer[2:]


def upload(gateway: Gateway, index: int, subindex: int) -> bytes:
    first = sdo(gateway, struct.pack("<BHB", 0x40, index, subindex))
    assert first[0] >> 5 == 2
    assert first[1:4] == struct.pack("<HB", index, subindex)
    if first[0] & 2:
        return first[4 : 8 - (first[0] >> 2 & 3)]
    size = struct.unpack("<I", first[4:8])[0]
    data = first[8:]
    toggle = 0
    while len(data) < size:
        segment = sdo(gateway, bytes([0x60 | toggle]))
        assert segment[0] & 0x10 == toggle
        data += segment[1 : 8 - (segment[0] >> 1 & 7)] if len(segment) == 8 else segment[1:]
        toggle ^= 0x10
    return data[:size]


# --- FoE


def foe(gateway: Gateway, operation: int, number: int, body: bytes) -> tuple[int, int, bytes]:
    answer = gateway.exchange(FOE, struct.pack("<BBI", operation, 0, number) + body)
    operation, _, number = struct.unpack("<BBI", answer[:6])
    if operation == 5:
        raise RefusedError(number)
    return operation, number, answer[6:]


def foe_write(gateway: Gateway, name: str, data: bytes, mail_bytes: int) -> None:
    room = mail_bytes - 6 - FOE_HEADER
    operation, number, _ = foe(gateway, 2, 0, name.encode())
    assert (operation, number) == (4, 0)
    for packet in range(1, len(data) // room + 2):
        part = data[(packet - 1) * room : packet * room]
        operation, number, _ = foe(gateway, 3, packet, part)
        assert (operation, number) == (4, packet)


def foe_read(gateway: Gateway, name: str, mail_bytes: int) -> bytes:
    room = mail_bytes - 6 - FOE_HEADER
    operation, number, body = foe(gateway, 1, 0, name.encode())
    data = b""
    while True:
        assert operation == 3
        data += body
        if len(body) < room:
            gateway.send(FOE, struct.pack("<BBI", 4, 0, number))  # is not answered
            return data
        operation, number, body = foe(gateway, 4, number, b"")


# --- EoE


def set_ip(gateway: Gateway, mac: bytes, address: bytes, netmask: bytes) -> None:
    """IP parameters; an address is one number, its last byte first."""
    flags = 0x01 | 0x02 | 0x04
    body = struct.pack("<I", flags) + mac + address[::-1] + netmask[::-1] + bytes(8 + 32)
    answer = gateway.exchange(EOE, struct.pack("<BBH", 2, 1, 0) + body)
    assert answer[0] & 15 == 3
    if struct.unpack("<H", answer[2:4])[0]:
        raise RefusedError(struct.unpack("<H", answer[2:4])[0])


# --- commands


def do_upload(gateway: Gateway, arguments: list[str]) -> dict[str, object]:
    index, subindex, times = (int(a, 0) for a in arguments)
    values = {upload(gateway, index, subindex).hex() for _ in range(times)}
    return {"values": sorted(values)}


def do_file(gateway: Gateway, arguments: list[str]) -> dict[str, object]:
    name, size, mail_bytes = arguments[0], int(arguments[1]), int(arguments[2])
    data = bytes(i * 7 % 251 for i in range(size))
    foe_write(gateway, name, data, mail_bytes)
    is_same = foe_read(gateway, name, mail_bytes) == data
    return {"same": is_same, "again": foe_read(gateway, name, mail_bytes) == data}


def do_ip(gateway: Gateway, arguments: list[str]) -> dict[str, object]:
    mac = bytes.fromhex(arguments[0])
    set_ip(gateway, mac, socket.inet_aton(arguments[1]), socket.inet_aton(arguments[2]))
    return {}


def do_babble(gateway: Gateway, arguments: list[str]) -> dict[str, object]:
    """Bytes that are no message, in as many connections; each must be closed by the gateway."""
    closed = 0
    for i in range(int(arguments[0])):
        one = Gateway("tcp", gateway.station)
        one.socket.sendall(bytes((i * 37 + n) % 256 for n in range(1500)))
        try:
            closed += one.socket.recv(1) == b""
        except ConnectionError:
            closed += 1
    return {"closed": closed}


COMMANDS: dict[str, Callable[[Gateway, list[str]], dict[str, object]]] = {
    "upload": do_upload,
    "file": do_file,
    "ip": do_ip,
    "babble": do_babble,
}


def main() -> int:
    kind, station, command, *arguments = sys.argv[1:]
    gateway = Gateway(kind, int(station, 0))
    try:
        print(json.dumps(COMMANDS[command](gateway, arguments)))
    except RefusedError as why:
        print(json.dumps({"refused": why.args[0]}))
    except TimeoutError:
        print(json.dumps({"silent": True}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
