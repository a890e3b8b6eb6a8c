#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The wire from the simulated segment's SYNC0 pins to GPIO inputs of the machine in QEMU.

Reads the edges of `ecdaq-sim --edges PIPE` as they come and raises and lowers, for each, a line of
the PL061 of QEMU's machine `virt` (in the guest: chip 9030000.pl061, lines 0 to 7; line 3 is the
machine's power button). The guest sees an interrupt like that of a pin.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import socket
import stat
import sys
import time
from pathlib import Path
from typing import Any, TextIO

EPILOG = """\
PIPE is created if missing; start this before ecdaq-sim, and both before or after QEMU, whose
options are -qtest unix:QTEST,server=on,wait=off -qtest-log none -qmp unix:QMP,server=on,wait=off
"""
LINES = range(8)
POWER_BUTTON = 3
CONNECT_TIMEOUT_S = 60.0


class WireError(Exception):
    """Why there is no wire, in one line."""


class Connection:
    """Lines to and from a socket of QEMU."""

    def __init__(self, path: Path) -> None:
        self.path = path
        until = time.monotonic() + CONNECT_TIMEOUT_S
        while True:
            try:
                self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
                self.socket.connect(str(path))
                break
            except OSError as error:
                self.socket.close()
                if time.monotonic() > until:
                    raise WireError(f"{path}: {error.strerror}") from error
                time.sleep(0.1)
        self.file = self.socket.makefile("rb")

    def send(self, line: str) -> None:
        self.socket.sendall(line.encode() + b"\n")

    def receive(self) -> str:
        line = self.file.readline()
        if not line:
            raise WireError(f"{self.path}: QEMU is gone")
        return line.decode().strip()


class Monitor(Connection):
    """QEMU's monitor, which knows the chip."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.receive()
        self.ask("qmp_capabilities")

    def ask(self, command: str, **arguments: str) -> Any:
        self.send(json.dumps({"execute": command, "arguments": arguments}))
        while True:
            answer = json.loads(self.receive())
            if "error" in answer:
                raise WireError(f"{self.path}: {command}: {answer['error']['desc']}")
            if "return" in answer:
                return answer["return"]

    def chip(self) -> str:
        """The QOM path of the one PL061."""
        folder = "/machine/unattached"
        found = [
            f"{folder}/{item['name']}"
            for item in self.ask("qom-list", path=folder)
            if item["type"] == "child<pl061>"
        ]
        if len(found) != 1:
            raise WireError(f"{self.path}: this machine has {len(found)} PL061, not one")
        return found[0]


class Pins(Connection):
    """The chip's inputs, through QEMU's test socket."""

    def __init__(self, path: Path, chip: str) -> None:
        super().__init__(path)
        self.chip = chip

    def pulse(self, line: int) -> None:
        """Up and down again; both are done when this returns."""
        pin = f"set_irq_in {self.chip} unnamed-gpio-in {line}"
        self.send(f"{pin} 1\n{pin} 0")
        for _ in range(2):
            answer = self.receive()
            if not answer.startswith("OK"):
                raise WireError(f"{self.path}: '{answer}' to {pin}")


def open_pipe(path: Path) -> TextIO:
    """Waits for a writer."""
    with contextlib.suppress(FileExistsError):
        os.mkfifo(path)
    if not stat.S_ISFIFO(path.stat().st_mode):
        raise WireError(f"{path}: not a pipe: the edges in a file are too late for a wire")
    return path.open()


def carry(pipe: TextIO, pins: Pins, line_of: dict[int, int], log: TextIO | None) -> None:
    """Each edge to its line, until the writer has closed the pipe."""
    for edge in pipe:
        words = edge.split()
        if len(words) != 3:
            continue  # the rest of a line that another reader began
        slave, at_ns, dc_ns = (int(word) for word in words)
        line = line_of.get(slave)
        if line is None:
            continue
        began_ns = time.monotonic_ns()
        pins.pulse(line)
        if log is not None:
            times = (at_ns, dc_ns, began_ns, time.monotonic_ns())
            print(slave, *times, file=log, flush=True)


def take_lines(text: str) -> dict[int, int]:
    """SLAVE=LINE,..."""
    try:
        pairs = [pair.split("=") for pair in text.split(",")]
        line_of = {int(slave): int(line) for slave, line in pairs}
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not SLAVE=LINE[,SLAVE=LINE...]") from None
    for line in line_of.values():
        if line not in LINES or line == POWER_BUTTON:
            raise argparse.ArgumentTypeError(f"line {line}: there are 0 to 7 without 3")
    return line_of


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--edges", metavar="PIPE", type=Path, required=True)
    parser.add_argument("--qtest", metavar="QTEST", type=Path, required=True)
    parser.add_argument("--qmp", metavar="QMP", type=Path, required=True)
    parser.add_argument(
        "--lines",
        metavar="SLAVE=LINE,...",
        type=take_lines,
        default="0=0,1=1",
        help="(%(default)s)",
    )
    parser.add_argument(
        "--log",
        type=Path,
        help="a line an edge: slave, its time, DC time, ns until it was on the line",
    )
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        pins = Pins(arguments.qtest, Monitor(arguments.qmp).chip())
        with contextlib.ExitStack() as stack:
            log = stack.enter_context(arguments.log.open("w")) if arguments.log else None
            print(f"sync0-wire: {pins.chip}", file=sys.stderr, flush=True)
            while True:
                carry(stack.enter_context(open_pipe(arguments.edges)), pins, arguments.lines, log)
    except KeyboardInterrupt:
        return 0
    except (OSError, WireError) as error:
        print(f"sync0-wire: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
