# SPDX-License-Identifier: MIT
"""User instructions a cycle, counted by callgrind."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

from foreign import Unavailable

from bench.figures import Records
from bench.peers import BUILD, ROOT, Peer
from bench.running import Master, Run, RunError, SimulatedSegment, Timing, Wire, again

sys.path.insert(0, str(ROOT / "tests" / "cost"))
from counting import PLAIN_PROCESSOR, Profile, count

# Slow enough for a program that callgrind executes.
PERIOD_NS = 10_000_000
SETTLE = 50
CYCLES = (100, 400)
COST_CYCLES = 128


def need_valgrind() -> None:
    if shutil.which("valgrind") is None:
        raise Unavailable("valgrind is missing (app/tools/packages.txt: valgrind)")


def of_ecdaq(slaves: int) -> float:
    """All of the cycle, as `./build.sh measure cycle` counts it."""
    need_valgrind()
    os.environ["ECDAQ_BUILD"] = str(BUILD)
    return count("cycle", slaves, COST_CYCLES, "still").instructions / COST_CYCLES


def of_peer(wire: Wire, peer: Peer, command: list[str], slaves: int) -> float:
    """Of the exchange alone where a function does it, else of the whole process in OP: the
    difference of a long and a short run."""
    need_valgrind()
    short, long = CYCLES
    if peer.counted:
        options = [f"--toggle-collect={peer.counted}"]
        return collected(wire, command, slaves, long, options) / (SETTLE + long)
    totals = [collected(wire, command, slaves, cycles, []) for cycles in CYCLES]
    return (totals[1] - totals[0]) / (long - short)


def collected(
    wire: Wire, command: list[str], slaves: int, cycles: int, options: list[str]
) -> float:
    """All that callgrind collects: what @options choose, or everything from OP on."""
    profile = wire.folder / "profile"
    timing = Timing(cycles, PERIOD_NS, SETTLE)
    words = ["env", f"GLIBC_TUNABLES={PLAIN_PROCESSOR}", "PYTHONHASHSEED=0", "valgrind", "-q"]
    words += ["--tool=callgrind", f"--callgrind-out-file={profile}", "--compress-pos=no"]
    words += options or ["--instr-atstart=no"]

    def run() -> Run:
        with SimulatedSegment(wire, slaves):
            master = Master(wire, command, timing, wrapper=words)
            master.wait_for_op()
            if not options:
                on = ["vgdb", f"--pid={master.loop.pid}", "instrumentation", "on"]
                if subprocess.run(on, capture_output=True, timeout=20).returncode != 0:
                    master.end()
                    raise RunError("callgrind did not begin to count")
            master.finish(timing.seconds())
        return Run(0, Records.empty())

    again(run)
    return Profile(profile.read_text()).total
