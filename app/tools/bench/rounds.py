# SPDX-License-Identifier: MIT
"""All runs of `./build.sh bench peers`, and the rows that they make."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from foreign import Unavailable

from bench import instructions
from bench.figures import Records, Times, mean, percentiles, runs
from bench.peers import PEERS, Peer, cyclictest
from bench.running import (
    PERIOD_NS,
    STRACE_PERIOD_NS,
    Load,
    LoadMeter,
    Run,
    RunError,
    Wire,
    is_tracer_there,
    run_cycles,
    run_cyclictest,
    run_echo,
    run_loss,
    run_strace,
)

ECDAQ = "ecdaq"
ECHO = "raw echo"
SLEEP = "cyclictest"


@dataclass(frozen=True)
class Plan:
    """What is asked for."""

    # Of the simulated segments; None alone: whatever is on the interface.
    slaves: list[int]
    cycles: int
    rounds: int
    interface: str | None = None


@dataclass
class Row:
    """One master, or a floor, with one number of slaves."""

    name: str
    slaves: int
    runs: list[Run] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    losses: list[int] = field(default_factory=list)
    instructions: float | None = None
    calls: float | None = None
    service_calls: float | None = None

    @property
    def is_disturbed(self) -> bool:
        return any(load.is_disturbed for load in self.loads)

    def pooled(self, of: Callable[[Records], Times]) -> list[int]:
        """Percentiles over all rounds."""
        parts = [of(run.records) for run in self.runs]
        return percentiles(np.concatenate(parts)) if parts else []

    def figures(self) -> dict[str, Any]:
        """As in the JSON."""
        spreads = [run.spread for run in self.runs if run.spread]
        is_master = self.name not in (ECHO, SLEEP)
        has_frames = self.name != SLEEP
        lost = [int(run.records.lost(PERIOD_NS).sum()) for run in self.runs] if has_frames else []
        return {
            "name": self.name,
            "slaves": self.slaves,
            "rounds": len(self.runs),
            "disturbed_rounds": sum(load.is_disturbed for load in self.loads),
            "wake_latency_ns": self.pooled(Records.latency_ns),
            "interval_ns": self.pooled(Records.interval_ns) if has_frames else [],
            "round_trip_ns": self.pooled(lambda r: r.answered_ns(PERIOD_NS)) if has_frames else [],
            "cycles": sum(len(run.records.wake_ns) for run in self.runs),
            "cycles_lost": sum(lost) if has_frames else None,
            "cycles_lost_per_lost_frame": mean(self.losses),
            "cycles_lost_per_lost_frame_most": max(self.losses, default=None),
            "free_run_per_s": mean([run.free_rate for run in self.runs if run.free_rate]),
            "sync0_spread_ns": max((s[0] for s in spreads), default=None),
            "sync0_spread_second_half_ns": max((s[1] for s in spreads), default=None),
            "time_to_op_s": mean([run.op_s for run in self.runs]) if is_master else None,
            "starts": sum(run.attempts for run in self.runs),
            "instructions_per_cycle": self.instructions,
            "system_calls_per_cycle": self.calls,
            "service_thread_calls_per_s": self.service_calls,
        }


class Bench:
    """The rows, and what is missing, with the reason."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.rows: dict[tuple[str, int], Row] = {}
        self.missing: dict[str, str] = {}
        self.round_lines: list[str] = []
        self.wire = Wire(plan.interface)

    def row(self, name: str, slaves: int) -> Row:
        return self.rows.setdefault((name, slaves), Row(name, slaves))

    def note(self, text: str) -> None:
        print(f"-- {text}", file=sys.stderr, flush=True)

    def first_reason(self) -> str:
        return next((f"{what}: {why}" for what, why in self.missing.items()), "")

    def attempt(self, what: str, work: Callable[[], None]) -> None:
        """Do it, or keep the reason why not."""
        self.note(what)
        try:
            work()
        except (Unavailable, RunError, ValueError, RuntimeError) as why:
            self.missing[what] = str(why).strip().splitlines()[-1]
            self.note(f"{what}: {why}")

    def masters(self) -> list[tuple[Peer, list[str] | None]]:
        """Those that can take part, with their commands; ecdaq first."""
        found: list[tuple[Peer, list[str] | None]] = [(Peer(ECDAQ, lambda: []), None)]
        for peer in PEERS:
            try:
                found.append((peer, peer.command()))
            except Unavailable as why:
                self.missing[peer.name] = str(why)
                self.note(f"{peer.name}: {why}")
        return found

    def measured(self, number: int, row: Row, run: Callable[[], Run]) -> None:
        meter = LoadMeter()
        result = run()
        load = meter.load()
        row.runs.append(result)
        row.loads.append(load)
        trips = percentiles(result.records.answered_ns(PERIOD_NS))
        text = f"round trip p50 {trips[0] / 1000:.1f} us" if trips and row.name != SLEEP else ""
        mark = "disturbed" if load.is_disturbed else ""
        self.round_lines.append(
            f"{number:5} {row.slaves or '':>6} {row.name:10} {load.average:5.2f} "
            f"{load.others:6.2f} {load.stolen:6.2f} {mark:9} {text}".rstrip()
        )

    def one_round(self, number: int, masters: list[tuple[Peer, list[str] | None]]) -> None:
        cycles = self.plan.cycles
        what = f"round {number}"
        self.attempt(
            f"{what}, {SLEEP}",
            lambda: self.measured(
                number, self.row(SLEEP, 0), lambda: run_cyclictest(self.wire, cyclictest(), cycles)
            ),
        )
        for slaves in self.plan.slaves:
            named = f"{what}, {slaves} slaves" if slaves else what
            if self.wire.space:
                self.attempt(
                    f"{named}, {ECHO}",
                    lambda n=slaves: self.measured(
                        number, self.row(ECHO, n), lambda: run_echo(self.wire, n, cycles)
                    ),
                )
            for peer, command in masters:
                self.attempt(
                    f"{named}, {peer.name}",
                    lambda p=peer, c=command, n=slaves: self.measured(
                        number, self.row(p.name, n), lambda: run_cycles(self.wire, c, n, cycles)
                    ),
                )

    def once(self, slaves: int, peer: Peer, command: list[str] | None) -> None:
        """What does not need rounds."""
        row = self.row(peer.name, slaves)
        named = f"{slaves} slaves, {peer.name}"

        def lose() -> None:
            records = run_loss(self.wire, command, slaves, self.plan.cycles)
            row.losses += runs(records.lost(PERIOD_NS))

        def trace() -> None:
            is_tracer_there()
            per_cycle = STRACE_PERIOD_NS / 1e9
            row.calls = run_strace(self.wire, command, slaves) * per_cycle
            if command is None:
                row.service_calls = run_strace(self.wire, command, slaves, ())

        def instruct() -> None:
            row.instructions = (
                instructions.of_ecdaq(slaves)
                if command is None
                else instructions.of_peer(self.wire, peer, command, slaves)
            )

        self.attempt(f"{named}, lost frames", lose)
        self.attempt(f"{named}, system calls", trace)
        self.attempt(f"{named}, instructions", instruct)

    def run(self) -> None:
        try:
            masters = self.masters()
            for number in range(1, self.plan.rounds + 1):
                self.one_round(number, masters)
            if self.wire.space is None:
                why = "only on the simulated segment"
                self.missing["raw echo, lost frames, free run, SYNC0, calls, instructions"] = why
                return
            for slaves in self.plan.slaves:
                for peer, command in masters:
                    self.once(slaves, peer, command)
        finally:
            self.wire.close()


def write_json(path: Path, bench: Bench, head: dict[str, str]) -> None:
    import json

    rows = [row.figures() for row in bench.rows.values() if row.runs]
    loads = [
        {"name": row.name, "slaves": row.slaves, "load_average": load.average,
         "others_cpus": load.others, "stolen_cpus": load.stolen, "disturbed": load.is_disturbed}
        for row in bench.rows.values()
        for load in row.loads
    ]  # fmt: skip
    whole = head | {"rows": rows, "rounds": loads, "missing": bench.missing}
    path.write_text(json.dumps(whole, indent=1) + "\n")
