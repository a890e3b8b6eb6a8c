#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Send one line to a running ecdaq-sim and print its answer."""

from __future__ import annotations

import argparse
import os
import socket
import sys
import tempfile
from pathlib import Path

EPILOG = """\
LINE is an io line or a fault line, as `ecdaq-sim --help` lists them:
  io slave=0              the values at the terminals of slave 0
  io slave=0 slot3.1=1    the same, after channel 1 of its third module is set
  at=1s for=200ms lose    a fault
"""


def send(path: Path, line: str) -> str:
    """The segment's answer to @line; OSError if there is none."""
    with (
        tempfile.TemporaryDirectory(prefix="ecdaq-tell-") as folder,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as s,
    ):
        s.bind(f"{folder}/me")
        s.settimeout(10)
        s.sendto(line.encode(), str(path))
        return s.recv(4096).decode()


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("line", metavar="LINE", nargs="+")
    parser.add_argument(
        "--control",
        type=Path,
        default=Path(os.environ.get("ECDAQ_RUN_DIR", ".")) / "segment",
        help="its control socket (default: $ECDAQ_RUN_DIR/segment)",
    )
    arguments = parser.parse_args()
    try:
        print(send(arguments.control, " ".join(arguments.line)))
    except OSError as error:
        why = "no answer" if isinstance(error, TimeoutError) else error.strerror
        print(f"tell-segment: {arguments.control}: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
