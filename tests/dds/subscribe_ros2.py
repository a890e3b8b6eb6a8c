# SPDX-License-Identifier: MIT
"""INTERFACE DOMAIN COUNT OUT: COUNT messages of the ROS 2 topic /ecdaq/sample, as CSV."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import ecdaq
from test_ros2 import Sample


def main() -> None:
    interface, domain, count, out = sys.argv[1:]
    lines = []
    with ecdaq.connect(interface, domain=int(domain)) as link:
        reader = link.reader(Sample, topic="rt/ecdaq/sample")
        link.channels()
        end = time.monotonic() + 60
        while len(lines) < int(count) and time.monotonic() < end:
            for m in link._take(reader, 0.2):
                lines.append(f"{m.slave_},{m.cycle_},{m.raw_[2]},{m.raw_[3]}\n")
    Path(out).write_text("".join(lines))


if __name__ == "__main__":
    main()
