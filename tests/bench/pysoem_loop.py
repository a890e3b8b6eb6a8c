# SPDX-License-Identifier: MIT
"""A cyclic loop on pysoem, with the command line, output and records of tests/bench/loops/loop.h.

pysoem_loop.py PACKAGES NIC PERIOD_NS SETTLE CYCLES LIMIT_NS FREE_MS FILE
PACKAGES: the folder that pysoem is installed in.
"""

from __future__ import annotations

import array
import gc
import sys
import time
from pathlib import Path

sys.path.insert(0, sys.argv[1])

import pysoem

SAFEOP_US = 10_000_000
OP_CYCLES = 10_000


class Loop:
    """A master in OP, and its cycle."""

    def __init__(self, nic: str, period_ns: int, limit_ns: int) -> None:
        self.period_ns = period_ns
        self.limit_us = limit_ns // 1000
        self.integral = 0
        self.master = pysoem.Master()
        self.master.open(nic)
        if self.master.config_init() <= 0:
            sys.exit("pysoem: no slaves")
        self.master.config_dc()
        # SAFE-OP is requested below, when SYNC0 is set up: a Piccolo refuses it without.
        self.master.manual_state_change = True
        self.master.config_map()
        for slave in self.master.slaves:
            slave.dc_sync(True, period_ns)
        self.request(pysoem.SAFEOP_STATE)
        if self.master.state_check(pysoem.SAFEOP_STATE, SAFEOP_US) != pysoem.SAFEOP_STATE:
            sys.exit("pysoem: a slave did not reach SAFE-OP")
        self.wait_for_op()

    def request(self, state: int) -> None:
        self.master.state = state
        self.master.write_state()

    def exchange(self) -> bool:
        self.master.send_processdata()
        return self.master.receive_processdata(self.limit_us) == self.master.expected_wkc

    def correction_ns(self) -> int:
        """As SOEM's red_test.c: half a period after SYNC0."""
        delta = (self.master.dc_time - self.period_ns // 2) % self.period_ns
        if delta > self.period_ns // 2:
            delta -= self.period_ns
        self.integral += (delta > 0) - (delta < 0)
        return -int(delta / 100) - int(self.integral / 20)

    def wait_for_op(self) -> None:
        deadline = time.monotonic_ns() + self.period_ns
        for i in range(OP_CYCLES):
            wait_until(deadline)
            self.exchange()
            deadline += self.period_ns + self.correction_ns()
            if i == 10:
                self.request(pysoem.OP_STATE)
            if i > 10 and i % 10 == 0 and self.master.read_state() == pysoem.OP_STATE:
                return
        sys.exit("pysoem: a slave did not reach OP")


def wait_until(deadline_ns: int) -> None:
    left = deadline_ns - time.monotonic_ns()
    if left > 0:
        time.sleep(left / 1e9)


def main() -> None:
    _, nic, *numbers, file = sys.argv[1:]
    period_ns, settle, cycles, limit_ns, free_ms = map(int, numbers)
    loop = Loop(nic, period_ns, limit_ns)
    gc.disable()
    print(f"slaves {len(loop.master.slaves)}")
    print(f"op {time.monotonic_ns()}", flush=True)
    records = array.array("q")
    deadline = time.monotonic_ns() + period_ns
    for i in range(-settle, cycles):
        wait_until(deadline)
        wake = time.monotonic_ns()
        has_answered = loop.exchange()
        back = time.monotonic_ns()
        if i >= 0:
            records.extend((wake, wake - deadline, 0, back - wake, has_answered))
        deadline += period_ns + loop.correction_ns()
    Path(file).write_bytes(records.tobytes())
    if free_ms > 0:
        start = now = time.monotonic_ns()
        answers = 0
        while now - start < free_ms * 1_000_000:
            answers += loop.exchange()
            now = time.monotonic_ns()
        print(f"free {answers} {now - start}", flush=True)
    loop.request(pysoem.INIT_STATE)
    loop.master.close()


if __name__ == "__main__":
    main()
