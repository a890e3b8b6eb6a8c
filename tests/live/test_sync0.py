# SPDX-License-Identifier: MIT
"""ecdaq-sync0 beside the master, on the edges of the simulated segment."""

from __future__ import annotations

import json
import os
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

from segment import BIN, Segment, Undisturbed, recorded, wait_for

# These measure time, or need a cycle in time.
IDLE = True
WINDOW = "1s"


class Checked:
    """A segment whose edges ecdaq-sync0 follows."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        self.edges = segment.folder / "edges"
        self.control = segment.folder / "control"
        self.dump = segment.folder / "dump"
        segment.start_sim("--edges", str(self.edges), "--control", str(self.control))
        segment.start_daemon()
        segment.wait_for_op()
        self.start_check()

    def start_check(self) -> None:
        self.segment.start(
            "sync0",
            str(BIN / "ecdaq-sync0"),
            *self.segment.options(),
            *["--edges", str(self.edges), "--dump", str(self.dump)],
            *["--set", f"sync0.window={WINDOW}"],
        )

    def fault(self, line: str) -> None:
        answer = self.segment.folder / "answer"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.bind(str(answer))
            sock.settimeout(30)
            sock.sendto(line.encode(), str(self.control))
            assert sock.recv(256).decode().strip() == "ok"
        answer.unlink()

    def report(self) -> dict[str, Any]:
        got = self.segment.ecdaq("sync0", "--json", check=False)
        return json.loads(got.stdout) if got.returncode == 0 else {}

    def events(self) -> list[dict[str, Any]]:
        lines = self.segment.ecdaq("events", "--json").stdout.splitlines()
        return [e for e in map(json.loads, lines) if e["event"].startswith("sync0_")]

    def wait_for_windows(self, count: int) -> dict[str, Any]:
        def closed() -> dict[str, Any]:
            report = self.report()
            return report if report.get("windows", 0) >= count else {}

        return wait_for(f"{count} windows", closed, 120)


def silent_cycles(dump: Path, edges: Path, slave: int, other: int) -> list[int]:
    """The cycles in which @other had an edge and @slave had none, by their DC times."""
    due: dict[int, int] = {}
    for line in dump.read_text().splitlines():
        if line.startswith("c "):
            words = line.split()
            due[int(words[2])] = int(words[1])
    seen: dict[int, set[int]] = {slave: set(), other: set()}
    for line in edges.read_text().splitlines()[:-1]:
        pos, _, dc = line.split()
        seen[int(pos)].add(int(dc))
    end = max(seen[slave])  # the file may end between two edges of one instant
    return sorted(due[dc] for dc in seen[other] - seen[slave] if dc in due and dc < end)


def test_missing_pulses_are_reported_with_slave_and_cycle(
    make_segment: Callable[..., Segment],
) -> None:
    checked = Checked(make_segment())
    segment = checked.segment
    segment.start_recorder()
    report = checked.wait_for_windows(2)
    assert report["source"] == "simulated edges"
    assert [line["slave"] for line in report["lines"]] == [0, 1]
    pulses = ("sync0_missing", "sync0_extra", "sync0_lost")
    assert [e for e in checked.events() if e["event"] in pulses] == []
    checked.fault("at=0s sync0-lost slave=1 count=3")

    def missing() -> list[dict[str, Any]]:
        return [e for e in checked.events() if e["event"] == "sync0_missing"]

    events = wait_for("a missing pulse", missing, 120)
    assert len(events) == 1
    assert events[0]["slave"] == 1
    assert events[0]["arg"][0] == 3
    first = events[0]["value"]
    done = checked.report()["windows"]
    wait_for("another window", lambda: checked.report()["windows"] > done, 120)
    assert "missing" in segment.ecdaq("sync0").stdout
    assert "lines" in segment.status()["sync0"]
    assert "values" in segment.ecdaq("sync0", "--histogram").stdout
    segment.stop("sync0")
    truth = silent_cycles(checked.dump, checked.edges, slave=1, other=0)
    assert truth == [first, first + 1, first + 2]
    segment.stop("recorder")
    bad = [m for m in recorded(segment.record_dir, "/ecdaq/sync0") if m.missing > 0]
    assert [(m.slave, m.missing, m.first_missing, m.verdict) for m in bad] == [
        (1, 3, first, "FAIL")
    ]
    names = [m.name for m in recorded(segment.record_dir, "/ecdaq/event")]
    assert names.count("sync0_missing") == 1


def test_a_slave_that_loses_power_is_lost_and_the_check_may_be_killed(
    make_segment: Callable[..., Segment],
) -> None:
    checked = Checked(make_segment())
    segment = checked.segment
    checked.wait_for_windows(1)
    undisturbed = Undisturbed(segment)
    segment.stop("sync0", signal.SIGKILL)
    checked.start_check()
    pid = segment.processes["sync0"].pid
    wait_for("its own page", lambda: checked.report().get("pid") == pid, 60)
    checked.wait_for_windows(1)
    segment.wait_for_cycles(100, 60)
    undisturbed.check()
    checked.fault("at=0s sync0-lost slave=0 count=100000")
    events = wait_for(
        "SYNC0 lost",
        lambda: [e for e in checked.events() if e["event"] == "sync0_lost"],
        120,
    )
    assert [e["slave"] for e in events] == [0]
    assert checked.report()["lines"][0]["lost"] is True
    assert segment.stop("sync0") == 0


def test_edges_go_to_a_pipe_whose_reader_may_be_replaced(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    pipe = segment.folder / "pipe"
    os.mkfifo(pipe)

    def read_edges(count: int) -> list[list[int]]:
        with os.fdopen(os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)) as edges:
            if "sim" not in segment.processes:
                segment.start_sim("--edges", str(pipe))
                segment.start_daemon()
                segment.wait_for_op()
            os.set_blocking(edges.fileno(), True)
            lines = [edges.readline().split() for _ in range(count)]
            # Where the last one ended to read, a line may be cut.
            return [[int(word) for word in line] for line in lines[1:]]

    first = read_edges(200)
    undisturbed = Undisturbed(segment)
    segment.wait_for_cycles(100, 60)  # with no reader
    second = read_edges(200)
    for edges in (first, second):
        assert {slave for slave, _, _ in edges} == {0, 1}
        assert [at for _, at, _ in edges] == sorted(at for _, at, _ in edges)
    assert second[0][1] > first[-1][1]
    undisturbed.check()
