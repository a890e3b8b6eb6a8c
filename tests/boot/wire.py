# SPDX-License-Identifier: MIT
"""A segment on the host whose SYNC0 pins are wired to GPIO inputs of the machine, and the logs of
both sides: which pulse left the segment, which edge the kernel in the machine timed."""

from __future__ import annotations

import bisect
import os
import statistics
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from machine import AHEAD, TOOLS, TOP, Machine, wait_for

BIN = Path(os.environ.get("ECDAQ_BIN_DIR", TOP / "build" / "stage" / "bin"))
NS_PER_MS = 1_000_000
START_S = 120.0


class Wire:
    """ecdaq-sim at the machine's EtherCAT port, and sync0-wire.py from its edges to the machine."""

    def __init__(self, machine: Machine) -> None:
        assert machine.space is not None
        self.folder = machine.folder
        self.log = self.folder / "wire.log"
        at = self.folder
        self.processes = [
            subprocess.Popen(
                [
                    *(*AHEAD, TOOLS / "sync0-wire.py", "--edges", at / "edges"),
                    *("--qtest", at / "qtest", "--qmp", at / "qmp", "--log", self.log),
                ],
                stderr=(at / "wire.err").open("wb"),
                start_new_session=True,
            )
        ]
        try:
            wait_for("the wire", START_S, self.is_up)
            self.processes.append(
                subprocess.Popen(
                    [
                        *(*machine.space.enter, *AHEAD, BIN / "ecdaq-sim", "--interface", "ecat"),
                        *("--slaves", "2", "--edges", at / "edges", "--control", at / "control"),
                    ],
                    stderr=(at / "sim.err").open("wb"),
                    start_new_session=True,
                )
            )
        except BaseException:
            self.close()
            raise

    def is_up(self) -> bool:
        message = (self.folder / "wire.err").read_text()
        assert self.processes[0].poll() is None, message
        return (self.folder / "edges").exists()

    def fault(self, line: str) -> None:
        """Inject a fault into the segment; it answers ok."""
        tool = TOP / "app" / "tools" / "tell-segment.py"
        done = subprocess.run(
            [tool, "--control", self.folder / "control", line],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == "ok", done.stdout

    def close(self) -> None:
        for process in reversed(self.processes):
            process.terminate()
            process.wait(30)


@dataclass
class Pulse:
    """One pulse on its way: out of the segment, and onto the machine's input."""

    dc_ns: int
    host_ns: int
    put_ns: int  # not before this


@dataclass
class Edge:
    """One edge as the machine's kernel timed and counted it."""

    guest_ns: int
    seqno: int
    pulses: list[Pulse] = field(default_factory=list)  # that it is of: two, if they ran into one


class Books:
    """The edges sent (log), and what ecdaq-sync0 --dump has of the same time.

    The input keeps an edge until the machine takes it, and no second one beside it: the edge of a
    pulse is the first one after it. The clocks of both sides go alike and begin differently.
    """

    NOISE_NS = 300_000  # of where they begin

    def __init__(self, log: str, dump: str, period_ns: int) -> None:
        self.period_ns = period_ns
        self.pulses: dict[int, list[Pulse]] = {}
        self.edges: dict[int, list[Edge]] = {}
        self.cycle_of: dict[int, int] = {}  # by DC time
        self.lateness_ns: dict[int, dict[int, float]] = {}  # of slaves, by cycle
        self.merged: dict[int, int] = {}  # pulses that ran into the next
        guest_of: dict[int, int] = {}  # guest time of a DC time, by the frames
        for line in log.splitlines()[:-1]:  # the last one may be half written
            slave, host_ns, dc_ns, put_ns, _done = (int(word) for word in line.split())
            self.pulses.setdefault(slave, []).append(Pulse(dc_ns, host_ns, put_ns))
        for line in dump.splitlines():
            words = line.split()
            if words[0] == "c":
                cycle, due, frame, mono = (int(word) for word in words[1:5])
                self.cycle_of[due] = cycle
                if frame != 0:
                    guest_of[due] = mono - (frame - due)
            elif words[0] != "l":  # the head: what each line is of
                slave, mono, _dc, seqno = (int(word) for word in words)
                self.edges.setdefault(slave, []).append(Edge(mono, seqno))
        self.begin_ns = self.beginning(guest_of)
        for slave in self.edges:
            self.match(slave)

    def beginning(self, guest_of: dict[int, int]) -> float:
        """Guest's clock less the host's: nearly by the frames, then by the fastest edges."""
        rough = statistics.median(
            guest_of[p.dc_ns] - p.host_ns for p in self.pulses[0] if p.dc_ns in guest_of
        )
        times = [edge.guest_ns for edge in self.edges[0]]
        fastest = []
        for pulse in self.pulses[0]:
            at = bisect.bisect_left(times, pulse.put_ns + rough - self.period_ns / 3)
            if at < len(times) and times[at] < pulse.put_ns + rough + self.period_ns / 3:
                fastest.append(times[at] - pulse.put_ns)
        return sorted(fastest)[len(fastest) // 100]

    def match(self, slave: int) -> None:
        """Give each edge its pulses."""
        edges = self.edges[slave]
        times = [edge.guest_ns for edge in edges]
        for pulse in self.pulses[slave]:
            at = bisect.bisect_left(times, pulse.put_ns + self.begin_ns - self.NOISE_NS)
            if at == 0:
                edges[0].pulses = [pulse]  # those before it were not listened to
            elif at < len(edges):
                edges[at].pulses.append(pulse)
        off = [
            (self.cycle_of[p.dc_ns], edge.guest_ns - p.host_ns - self.begin_ns)
            for edge in edges
            for p in edge.pulses
            if p.dc_ns in self.cycle_of
        ]
        usual = statistics.median(late for _cycle, late in off)
        self.lateness_ns[slave] = {cycle: late - usual for cycle, late in off}
        self.merged[slave] = sum(max(len(edge.pulses) - 1, 0) for edge in edges)

    def invented(self, slave: int) -> list[Edge]:
        """Edges of no pulse."""
        return [edge for edge in self.edges[slave] if not edge.pulses]

    def cycle_near(self, slave: int, edge: Edge) -> int:
        """The cycle of the slave's pulse that is nearest to an edge."""
        at = edge.guest_ns - self.begin_ns
        pulses = (p for p in self.pulses[slave] if p.dc_ns in self.cycle_of)
        return self.cycle_of[min(pulses, key=lambda p: abs(p.put_ns - at)).dc_ns]

    def dropped(self, slave: int) -> int:
        """How many the kernel dropped, by its own count from 1."""
        return self.edges[slave][-1].seqno - len(self.edges[slave])

    def displaced(self, slave: int, limit_ns: float) -> set[int]:
        """Cycles whose edge came too early or late by so much: the emulator's noise."""
        return {cycle for cycle, late in self.lateness_ns[slave].items() if abs(late) > limit_ns}

    def silent(self, slave: int, other: int) -> list[int]:
        """Cycles in which @other's pulse left the segment and @slave's did not, as far as both
        are in the logs."""
        seen = {p.dc_ns for p in self.pulses[slave]}
        until = min(pulses[-1].dc_ns for pulses in self.pulses.values())
        return sorted(
            self.cycle_of[p.dc_ns]
            for p in self.pulses[other]
            if p.dc_ns not in seen and p.dc_ns in self.cycle_of and p.dc_ns < until
        )
