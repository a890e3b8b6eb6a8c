# SPDX-License-Identifier: MIT
"""Instructions of a cycle of the master, by number of slaves: `./build.sh measure cycle`."""

from __future__ import annotations

import platform
import subprocess

from counting import Count, count

SLAVES = (2, 16, 64, 512)
CYCLES = 128
# With all that they call; the rest of cycle_step() is the last column.
PARTS = {
    "exchange": "exchange_run",
    "judge": "cycle_judge",
    "ring": "cycle_push_sample",
    "servo": "cycle_follow",
    "outputs": "outputs_choose",
}


def per_cycle(slaves: int, outputs: str) -> Count:
    return count("cycle", slaves, CYCLES, outputs)


def main() -> None:
    gcc = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True)
    print(f"{gcc.stdout.splitlines()[0]}, release build, {platform.machine()}")
    print("user instructions a cycle in OP, FB1111-Piccolos, DC, monitor and mailbox states on;")
    print("of it the exchange without the NIC, judging the counters, the sample ring, the servo,")
    print("the outputs; commanded: a new value of each output in each cycle")
    print()
    head = ["slaves", "still", "one more", *PARTS, "rest", "commanded", "one more"]
    print(" ".join(f"{word:>9}" for word in head))
    last: tuple[int, float, float] | None = None
    for slaves in SLAVES:
        still = per_cycle(slaves, "still")
        commanded = per_cycle(slaves, "commanded").instructions / CYCLES
        total = still.instructions / CYCLES
        parts = [still.inclusive[function] / CYCLES for function in PARTS.values()]
        more = ["", ""]
        if last is not None:
            since = slaves - last[0]
            more = [f"{(total - last[1]) / since:.1f}", f"{(commanded - last[2]) / since:.1f}"]
        numbers = [f"{n:.0f}" for n in (*parts, total - sum(parts))]
        row = [f"{slaves}", f"{total:.0f}", more[0], *numbers, f"{commanded:.0f}", more[1]]
        print(" ".join(f"{word:>9}" for word in row))
        last = (slaves, total, commanded)


if __name__ == "__main__":
    main()
