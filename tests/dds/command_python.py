# SPDX-License-Identifier: MIT
"""A commander on the PC: reads one JSON command a line, prints one JSON answer a line."""

from __future__ import annotations

import json
import sys
import time

import ecdaq


def command(link: ecdaq.Link, asked: dict) -> dict:
    """Send the command as given, with its errors; the first reply to it."""
    before = max((s.cycle for s in link.subscribe(0.005)), default=0)
    started = time.monotonic()
    sent_ns = time.monotonic_ns()
    number = link.send(
        asked["values"],
        raw=asked.get("raw", False),
        not_after_cycle=asked.get("not_after_cycle", 0),
        session=asked.get("session", 0),
        message_id=asked.get("id"),
    )
    while time.monotonic() - started < 5:
        for reply in link.replies(0.2):
            if reply.id == number:
                return {
                    "accepted": reply.is_accepted,
                    "cycle": reply.cycle,
                    "reason": reply.reason,
                    "cycles_later": reply.cycle - before,
                    "sent_ns": sent_ns,
                    "ms": (time.monotonic() - started) * 1e3,
                }
    return {"accepted": False, "reason": "no answer", "cycle": 0, "cycles_later": 0, "ms": 0}


def main() -> None:
    interface, domain = sys.argv[1:]
    with ecdaq.connect(interface, domain=int(domain)) as link:
        print(json.dumps({"ready": [c.name for c in link.channels(60)]}), flush=True)
        for line in sys.stdin:
            print(json.dumps(command(link, json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
