# SPDX-License-Identifier: MIT
"""Wait for results on ecdaq/sync0 of so many slaves; print each slave's newest as JSON."""

from __future__ import annotations

import argparse
import json
import time

import ecdaq
from ecdaq.idl_types import Sync0V1


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--interface", required=True)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--slaves", type=int, required=True)
    parser.add_argument("--seconds", type=float, default=60)
    given = parser.parse_args()
    newest: dict[int, Sync0V1] = {}
    end = time.monotonic() + given.seconds
    with ecdaq.connect(given.interface, domain=given.domain) as link:
        reader = link.reader(Sync0V1, is_state=True)
        while len(newest) < given.slaves and time.monotonic() < end:
            for m in link._take(reader, 1.0):
                newest[m.slave] = m
    for slave, m in sorted(newest.items()):
        print(json.dumps({"slave": slave, "verdict": m.verdict, "source": m.source,
                          "edges": m.edges, "cycles": m.cycles, "missing": m.missing}))  # fmt: skip


if __name__ == "__main__":
    main()
