# SPDX-License-Identifier: MIT
"""Write what comes on ecdaq/sample (or ecdaq/block) to a CSV file, for some seconds."""

from __future__ import annotations

import argparse
import csv
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ecdaq

FIELDS = [
    "slave",
    "session",
    "cycle",
    "dc_time_ns",
    "flags",
    "is_good",
    "adc",
    "counter",
    "sample_time_ns",
    "raw",
    "taken_ns",
]


def of_samples(link: ecdaq.Link, seconds: float) -> Iterator[list[Any]]:
    for s in link.subscribe(seconds):
        yield [
            s.slave,
            s.session,
            s.cycle,
            s.dc_time_ns,
            s.flags,
            int(s.is_good),
            f"{s.adc:.17g}",
            s.counter,
            s.sample_time_ns,
            " ".join(map(str, s.raw)),
            time.monotonic_ns(),
        ]


def of_blocks(link: ecdaq.Link, seconds: float) -> Iterator[list[Any]]:
    for b in link.blocks(seconds):
        taken_ns = time.monotonic_ns()
        n = b.channel_count
        for k in range(b.count):
            raw = b.raw[k * n : (k + 1) * n]
            yield [
                b.slave,
                b.session,
                b.cycle[k],
                b.dc_time_ns[k],
                b.flags[k],
                int(b.is_good[k]),
                f"{b.adc[k]:.17g}",
                b.counter[k],
                b.sample_time_ns[k],
                " ".join(map(str, raw)),
                taken_ns,
            ]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--interface", required=True)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--blocks", action="store_true")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    with (
        ecdaq.connect(options.interface, domain=options.domain) as link,
        options.out.open("w", newline="") as file,
    ):
        link.channels()
        print("ready", flush=True)
        writer = csv.writer(file)
        writer.writerow(FIELDS)
        source = of_blocks if options.blocks else of_samples
        signal.signal(signal.SIGTERM, lambda *_: link.stop())
        writer.writerows(source(link, options.seconds))


if __name__ == "__main__":
    main()
