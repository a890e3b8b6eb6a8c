# SPDX-License-Identifier: MIT
"""Take channel table, status and samples of all slaves; print what was got as one JSON line.

INTERFACE DOMAIN SLAVES SECONDS: it ends some seconds after it has samples of all, after SECONDS at
the latest.
"""

from __future__ import annotations

import json
import math
import sys
import time

import ecdaq

MORE_S = 5.0


def main() -> None:
    interface, domain, slaves, seconds = sys.argv[1], *map(int, sys.argv[2:])
    with ecdaq.connect(interface, domain=domain) as link:
        channels = link.channels(30)
        status = link.status(30)
        wrong: list[str] = []
        cycles: dict[int, list[int]] = {}
        end = time.monotonic() + seconds
        had_all = math.inf
        while time.monotonic() < min(end, had_all + MORE_S):
            if len(cycles) == slaves and had_all == math.inf:
                had_all = time.monotonic()
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
