# SPDX-License-Identifier: MIT
"""An hour of two slaves at 1 kHz, recorded by ecdaq-record from a full ring, to a DataFrame.

python tests/kit/hour.py [RUNS]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from made import KIT, files, make

sys.path.insert(0, str(KIT))

import ecdaq

CYCLES = 3_600_000
# As the ring's depth must be a power of two.
DEPTH = 1 << 22


def report(what: str, runs: int, call: Callable[[], object]) -> None:
    """The best of @runs, since what else the machine does only makes it slower."""
    wall, cpu = [], []
    for _ in range(runs):
        started, cpu_started = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - started)
        cpu.append(time.process_time() - cpu_started)
    print(f"{what:45} {min(wall):7.2f} s wall {min(cpu):7.2f} s CPU", flush=True)


def main(runs: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-hour-") as scratch:
        folder = make(Path(scratch), ("--cycles", str(CYCLES), "--depth", str(DEPTH)))
        size = sum(path.stat().st_size for path in files(folder))
        print(f"{CYCLES} cycles of 2 slaves, 7 channels, {len(files(folder))} files, {size} bytes")
        import pandas  # noqa: F401  # not measured

        frame = ecdaq.read(folder).to_pandas()
        assert frame["cycle"].to_list() == list(range(CYCLES))
        assert frame.notna().to_numpy().all()
        print(f"DataFrame of {len(frame)} rows, {frame.shape[1]} columns; best of {runs} runs:")
        del frame
        report("all channels to a DataFrame", runs, lambda: ecdaq.read(folder).to_pandas())
        report("one channel", runs, lambda: ecdaq.read(folder)["piccolo0.adc"])
        span = (1_000_000, 1_000_999)
        report("a second of it", runs, lambda: ecdaq.read(folder, cycles=span).to_pandas())
        report("the fitted sine", 1, lambda: ecdaq.fit_sine(ecdaq.read(folder)["piccolo0.adc"]))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
