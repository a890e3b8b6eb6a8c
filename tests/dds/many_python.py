# SPDX-License-Identifier: MIT
"""Take channel table, status and samples of all slaves; print what was got as one JSON line."""

from __future__ import annotations

import json
import sys
import time

import ecdaq


def main() -> None:
    interface, domain, slaves, seconds = sys.argv[1], *map(int, sys.argv[2:])
    with ecdaq.connect(interface, domain=domain) as link:
        channels = link.channels(30)
        status = link.status(30)
        wrong: list[str] = []
        cycles: dict[int, list[int]] = {}
        end = time.monotonic() + seconds
        while time.monotonic() < end and (len(cycles) < slaves or time.monotonic() < end - 3):
            for s in link.subscribe(0.2):
                cycles.setdefault(s.slave, []).append(s.cycle)
                # Of piccolos without a shot: the time of the edge, and a number of values each.
                if s.is_good and (s.sample_time_ns != s.dc_time_ns or len(s.raw) != 6):
                    wrong.append(f"{s.slave}: {s.cycle}")
        print(
            json.dumps(
                {
                    "names": [c.name for c in channels],
                    "slave": [c.slave for c in channels],
                    "state": status.state,
                    "slaves": status.slaves,
                    "sampled": sorted(cycles),
                    "wrong": wrong[:10],
                }
            )
        )


main()
