# SPDX-License-Identifier: MIT
"""Recordings of many appliances, each of two slaves at 1 kHz, to one Parquet dataset; its queries.

python tests/kit/fleet.py [APPLIANCES [CYCLES]]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from made import KIT, files, make

sys.path.insert(0, str(KIT))

from ecdaq import dataset
from test_dataset import block, query

HOUR = 3_600_000
# What the recorder of every tenth appliance did not get.
SKIPPED = (20_000, 123)


def timed(call: Callable[[], object]) -> tuple[object, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    result = call()
    return result, time.perf_counter() - wall, time.process_time() - cpu


def bytes_below(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*.parquet"))


def record(fleet: Path, number: int, cycles: int) -> int:
    """Bytes of one appliance's recording."""
    options = ["--cycles", str(cycles), "--depth", str(1 << 18)]
    if number % 10 == 0:
        options += ["--skip", f"{SKIPPED[0]}:{SKIPPED[1]}"]
    folder = make(fleet / f"appliance-{number:03}", options)
    return sum(path.stat().st_size for path in files(folder))


def main(appliances: int, cycles: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-fleet-") as scratch:
        fleet, lake = Path(scratch) / "fleet", Path(scratch) / "lake"
        fleet.mkdir()
        size = sum(record(fleet, number, cycles) for number in range(appliances))
        hours = appliances * cycles / HOUR
        print(f"{appliances} appliances, {cycles} cycles each: {hours:.2f} appliance hours")
        words = [str(fleet), str(lake)]
        code, wall, cpu = timed(lambda: dataset.main(words))
        assert code == 0
        print(f"conversion                 {wall:7.1f} s wall {cpu:7.1f} s CPU")
        code, wall, again = timed(lambda: dataset.main(words))
        assert code == 0
        print(f"the same, nothing new      {wall:7.1f} s wall {again:7.1f} s CPU")
        for title in ("How many samples", "What is missing", "The largest value of every hour"):
            sql = block(title)
            rows, wall, cpu_query = timed(lambda sql=sql: query(lake, sql))
            print(f"{title:32} {wall:5.2f} s wall {cpu_query:5.2f} s CPU {len(rows):4} rows")
        missing = {name: lost for name, _, lost in query(lake, block("What is missing"))}
        wanted = {f"appliance-{n:03}": SKIPPED[1] if n % 10 == 0 else 0 for n in range(appliances)}
        assert missing == wanted
        print(f"cycles missing: {sum(missing.values())}, as many as were left out")
        print("an appliance hour of two slaves:")
        for what, amount in (("recordings", size), ("Parquet", bytes_below(lake))):
            hour = amount / hours
            print(f"  {what:11} {hour / 1e6:8.1f} MB {hour / HOUR:6.1f} bytes a cycle")
        print(f"  conversion  {cpu / hours:8.1f} s of CPU")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    main(*(numbers + [50, 60_000][len(numbers) :]))
