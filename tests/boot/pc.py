# SPDX-License-Identifier: MIT
"""The program on the PC: reads samples for some seconds, then switches the LED on, off and on.

pc.py INTERFACE DOMAIN SECONDS; one JSON object on standard output. The kit
(share/ecdaq/python of an installed ecdaq) must be on PYTHONPATH.
"""

from __future__ import annotations

import json
import sys
import time

import ecdaq

LED = "piccolo0.led"
TIMEOUT_S = 120.0

# What an emulator that stops for a second makes of a command: the bus has left OP, or the cycle
# thread did not run before the command's time was over. The user gives the command again.
AGAIN = ("the bus is not in OP", "not taken by the master in time: reverted")


def command(link: ecdaq.Link, value: int) -> tuple[int, int]:
    """Set the LED; the cycle that carried it, and after how many commands."""
    end = time.monotonic() + TIMEOUT_S
    tries = 0
    while True:
        tries += 1
        try:
            return link.command({LED: value}, seconds=TIMEOUT_S), tries
        except ecdaq.RefusedError as error:
            if str(error) not in AGAIN or time.monotonic() > end:
                raise
            link.events(1.0)


def led_follows(link: ecdaq.Link, value: int) -> dict[str, int]:
    """Command the LED; the first sample from that cycle on, and what the LED was in it."""
    place = link.channels()[LED].place
    cycle, tries = command(link, value)
    for sample in link.subscribe(TIMEOUT_S, slave=0):
        if sample.cycle >= cycle:
            seen = int(sample.raw[place])
            return {"expected": value, "cycle": cycle, "seen": seen, "commands": tries}
    return {"expected": value, "cycle": cycle, "seen": -1, "commands": tries}


def main() -> None:
    interface, domain, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    with ecdaq.connect(interface, domain=domain) as link:
        names = [c.name for c in link.channels(TIMEOUT_S)]
        taken = sum(1 for _ in link.subscribe(seconds))
        result = {
            "channels": names,
            "samples": taken,
            "gaps": link.gaps.gaps,
            "missing": link.gaps.missing,
            "doubled": link.gaps.doubled,
            "led": [led_follows(link, value) for value in (1, 0, 1)],
        }
    print(json.dumps(result))


if __name__ == "__main__":
    main()
