# SPDX-License-Identifier: MIT
"""The rows of a bench as the text of app/doc/results/peers.md."""

from __future__ import annotations

from typing import Any

from bench.figures import ratio
from bench.rounds import ECDAQ, ECHO, SLEEP, Bench
from bench.running import FREE_MS, LIMIT_NS, LOSS_EVERY, OTHERS_MOST, STOLEN_MOST, STRACE_PERIOD_NS

Figures = dict[str, Any]
# Of the single figures: heading, key, unit of the key, decimals, and whether more of it is better.
SINGLE = (
    ("lost per lost frame", "cycles_lost_per_lost_frame", 1, 2, False),
    ("free run /s", "free_run_per_s", 1, 0, True),
    ("SYNC0 ns", "sync0_spread_ns", 1, 0, False),
    ("2nd half ns", "sync0_spread_second_half_ns", 1, 0, False),
    ("to OP s", "time_to_op_s", 1, 2, False),
    ("instructions", "instructions_per_cycle", 1, 0, False),
    ("system calls", "system_calls_per_cycle", 1, 1, False),
)
TIMES = (
    ("wake latency", "wake_latency_ns"),
    ("interval", "interval_ns"),
    ("round trip", "round_trip_ns"),
)
NAMES = ("p50", "p99", "p99.9", "max")

EXPLAINED = f"""
Masters take turns on the same segment, started anew for each run, under SCHED_FIFO; 1 ms, DC with
SYNC0, FB1111-Piccolos.
wake latency: wake minus deadline. interval: from wake to wake. round trip: from before sending to
  after receiving, of the cycles that are not lost.
lost: no complete answer with the expected WKC before the cycle's end, which is the next deadline;
  skipped and late cycles are lost. An answer is waited for {LIMIT_NS // 1000} us; by EtherCrab,
  which has one time-out for bring-up and cycle, 2 ms.
lost per lost frame: mean length of a run of lost cycles while each {LOSS_EVERY}th frame is lost.
free run: good answers a second without pauses, for {FREE_MS} ms. ecdaq has no free run: its cycle's
  sleep is taken away.
SYNC0: largest distance between the slaves' edges, by the segment's own times, from OP on.
to OP: from the start of the program.
instructions: user instructions a cycle (callgrind). ecdaq: all of the cycle, without the NIC
  (`./build.sh measure cycle`); SOEM: send and receive alone; pysoem and EtherCrab: the process in
  OP, difference of two runs.
system calls: of the process, in a cycle of {STRACE_PERIOD_NS // 1000000} ms (strace).
raw echo: a frame as long as one with the slaves' data, by a packet socket at both ends.
* a round was disturbed: other programs took more than {OTHERS_MOST:.0%} of a core, or the machine
  below more than {STOLEN_MOST:.0%}. Its values are in the row.
ecdaq against the best peer: how many times as good it is; below 1: that peer is ahead.
""".strip()


def text_of(value: float | None, unit: float, decimals: int) -> str:
    return "-" if value is None else f"{value / unit:.{decimals}f}"


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    lines = []
    for row in [head, *rows]:
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join(cells).rstrip())
    return lines


def name_of(row: Figures) -> str:
    return row["name"] + ("*" if row["disturbed_rounds"] else "")


def times(rows: list[Figures]) -> list[str]:
    head = [
        "us",
        *(f"{what} {name}" if name == "p50" else name for what, _ in TIMES for name in NAMES),
    ]
    body = []
    for row in rows:
        cells = [name_of(row)]
        for _, key in TIMES:
            values = row[key] or [None] * len(NAMES)
            cells += [text_of(value, 1000, 1) for value in values]
        body.append(cells)
    return table(head, body)


def singles(rows: list[Figures]) -> list[str]:
    body = []
    for row in rows:
        lost = "-" if row["cycles_lost"] is None else f"{row['cycles_lost']} of {row['cycles']}"
        cells = [text_of(row[key], unit, decimals) for _, key, unit, decimals, _ in SINGLE]
        body.append([name_of(row), lost, *cells])
    lines = table(["", "lost", *(head for head, *_ in SINGLE)], body)
    for row in rows:
        if (calls := row["service_thread_calls_per_s"]) is not None:
            lines.append(
                f"system calls of {row['name']}'s idle service thread: {calls:.0f} a second"
            )
    return lines


def compared(rows: list[Figures]) -> list[str]:
    """ecdaq beside the best of the others, figure by figure."""
    ours = [row for row in rows if row["name"] == ECDAQ]
    others = [row for row in rows if row["name"] not in (ECDAQ, ECHO, SLEEP)]
    if not ours or not others:
        return []
    found = []
    for what, key in TIMES:
        for i, name in enumerate(NAMES):
            if key == "interval_ns" or not ours[0][key]:
                continue
            theirs = [row[key][i] for row in others if row[key]]
            found.append((f"{what} {name}", ratio(ours[0][key][i], theirs, False)))
    for head, key, _, _, more in SINGLE:
        found.append((head, ratio(ours[0][key], [row[key] for row in others], more)))
    known = [f"{name} {value:.2f}" for name, value in found if value is not None]
    return ["ecdaq against the best peer:", *wrapped(known)]


def wrapped(words: list[str]) -> list[str]:
    lines, line = [], " "
    for word in words:
        if len(line) + len(word) > 96:
            lines.append(line.rstrip(","))
            line = " "
        line += f" {word},"
    return [*lines, line.rstrip(",")]


def lines_of(bench: Bench) -> list[str]:
    rows = [row.figures() for row in bench.rows.values() if row.runs]
    if not any(row["name"] == ECDAQ for row in rows):
        return []
    plan = bench.plan
    lines = [f"rounds: {plan.rounds}, of {plan.cycles} cycles", "", *EXPLAINED.splitlines()]
    floor = [row for row in rows if row["name"] == SLEEP]
    for slaves in plan.slaves:
        here = [row for row in rows if row["slaves"] == slaves and row["name"] != SLEEP]
        title = f"{slaves} slaves" if slaves else f"slaves of {plan.interface}"
        lines += ["", title, *times([*floor, *here]), "", *singles(here), "", *compared(here)]
    lines += ["", "not measured, and why"]
    lines += [f"  {what}: {why}" for what, why in bench.missing.items()] or ["  nothing"]
    lines += ["", "rounds in their order: load average, CPUs that others took, CPUs stolen"]
    return [*lines, f"{'round':5} {'slaves':>6} {'':10} {'load':>5} {'others':>6} {'stolen':>6}",
            *bench.round_lines]  # fmt: skip
