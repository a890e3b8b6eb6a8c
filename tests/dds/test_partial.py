# SPDX-License-Identifier: MIT
"""With bus.datagrams: per_slave, all readers of a sample agree which slave is bad."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench import DDS_SETTINGS, ROOT, Bench, live, rows, wait_for
from flags import WKC_LOW

SLAVES = ("piccolo0", "piccolo1")
LAST = 1
ONLY_LAST_IS_BAD = tuple(slave != LAST for slave in range(len(SLAVES)))
FAULT_CYCLES = 500
MIN_CYCLES = 200  # of the fault that all readers have, on a busy machine too

Goodness = dict[int, tuple[bool, ...]]  # of a cycle: for each slave, whether its sample is good


def send_fault(bench: Bench, line: str) -> None:
    tool = ROOT / "app" / "tools" / "tell-segment.py"
    control = bench.segment.run_dir / "segment"
    got = subprocess.run(
        [sys.executable, tool, "--control", control, line],
        capture_output=True, text=True, timeout=30, check=True,
    )  # fmt: skip
    assert got.stdout == "ok\n", got


def start(bench: Bench) -> None:
    """The appliance in OP, DDS subscriber and `ecdaq watch`, each with samples."""
    segment = bench.segment
    segment.start_sim("--control", str(segment.run_dir / "segment"))
    segment.start_daemon()
    segment.start_recorder()
    segment.wait_for_op()
    bench.start_dds()
    bench.python(
        "python", "subscribe_python.py", "--interface", "dds1", "--domain",
        DDS_SETTINGS["dds.domain"], "--seconds", "600", "--out", str(bench.folder / "python.csv"),
    )  # fmt: skip
    segment.start(
        "watch", str(live.BIN / "ecdaq"), "--run-dir", str(segment.run_dir),
        "watch", "--json", *(f"{name}.counter" for name in SLAVES),
    )  # fmt: skip
    wait_for("samples over DDS", lambda: len(subscriber_lines(bench)) > 2, 30)
    wait_for("samples of ecdaq watch", lambda: segment.log("watch").count("\n") > 1, 30)


def subscriber_lines(bench: Bench) -> list[str]:
    path: Path = bench.folder / "python.csv"
    return path.read_text().splitlines() if path.exists() else []


def last_cycle(bench: Bench) -> int:
    """The newest whole row of the subscriber's file, while it grows."""
    return int(subscriber_lines(bench)[-2].split(",")[2])


def fail_last_slave(bench: Bench) -> range:
    """Power off and on again; the cycles from before the first to before the second."""
    segment = bench.segment
    before: int = segment.status()["cycle_number"]
    send_fault(bench, f"at=0s power-off slave={LAST}")
    wait_for("the loss", lambda: segment.status().get("state") == "RECOVERING", 30)
    segment.wait_for_cycles(FAULT_CYCLES, 30)
    after: int = segment.status()["cycle_number"]
    send_fault(bench, f"at=0s power-on slave={LAST}")
    segment.wait_for_op()
    return range(before, after + 1)


def exported(bench: Bench) -> tuple[Goodness, dict[int, int]]:
    """Of the recording, by `ecdaq log export`: goodness and flags of each cycle."""
    got = bench.segment.ecdaq("log", "export", str(bench.segment.record_dir))
    table = list(csv.DictReader(got.stdout.splitlines()))
    flags = {int(r["cycle"]): int(r["flags"]) for r in table}
    good = {int(r["cycle"]): tuple(r[f"{name}.good"] == "1" for name in SLAVES) for r in table}
    return good, flags


def watched(bench: Bench) -> Goodness:
    lines = [json.loads(line) for line in bench.segment.log("watch").splitlines()]
    samples: list[dict[str, Any]] = [line for line in lines if "cycle" in line]
    return {
        s["cycle"]: tuple(f"{name}.counter" not in s["bad"] for name in SLAVES) for s in samples
    }


def subscribed(bench: Bench) -> Goodness:
    """Cycles of which the samples of both slaves came."""
    found: dict[int, dict[int, bool]] = {}
    for r in rows(bench.folder / "python.csv"):
        found.setdefault(int(r["cycle"]), {})[int(r["slave"])] = r["is_good"] == "1"
    return {
        cycle: tuple(of[slave] for slave in range(len(SLAVES)))
        for cycle, of in found.items()
        if len(of) == len(SLAVES)
    }


def test_recording_watch_and_dds_agree_which_slave_is_bad_while_the_last_has_no_power(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**{"bus.datagrams": "per_slave"})
    start(bench)
    cycles = fail_last_slave(bench)
    end = bench.segment.status()["cycle_number"]
    wait_for("DDS' last cycles", lambda: last_cycle(bench) >= end, 60)
    assert bench.segment.stop("watch", signal.SIGINT) == 0
    bench.started[0].terminate()
    assert bench.started[0].wait(60) == 0, bench.logs()
    assert bench.segment.stop("dds") == 0
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0

    recording, flags = exported(bench)
    readers = {"watch": watched(bench), "DDS": subscribed(bench)}
    common = set(recording).intersection(*readers.values())
    for name, good in readers.items():
        wrong = {c: (flags[c], recording[c], good[c]) for c in common if good[c] != recording[c]}
        assert not wrong, (name, len(wrong), sorted(wrong.items())[:3])
    # The frame came back from the first slave as it should, and from the last not at all: where the
    # master was late, the watchdog of the first may have expired, too.
    halved = {
        m.cycle
        for m in live.recorded(bench.segment.record_dir, "/ecdaq/cycle")
        if m.flags == WKC_LOW and 2 * m.wkc == m.wkc_expected
    }
    flagged = [c for c in cycles if c in common and c in halved]
    print(f"{len(flagged)} common cycles without power")
    assert len(flagged) >= MIN_CYCLES
    assert {c: recording[c] for c in flagged if recording[c] != ONLY_LAST_IS_BAD} == {}
