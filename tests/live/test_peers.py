# SPDX-License-Identifier: MIT
"""`./build.sh bench peers`, with the C loop on SOEM alone, so short that it measures nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from segment import ROOT, Segment

sys.path.insert(0, str(ROOT / "app" / "tools"))
from bench import peers
from bench.page import lines_of
from bench.rounds import ECDAQ, ECHO, SLEEP, Bench, Plan, write_json

# These measure time, or need a cycle in time.
IDLE = True
CYCLES = 300


@pytest.fixture
def only_soem(monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        peers.soem()
    except peers.Unavailable as why:
        pytest.skip(str(why))
    monkeypatch.setattr("bench.rounds.PEERS", peers.PEERS[:1])


def test_a_short_run_has_a_row_for_each_and_says_what_is_missing(
    only_soem: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def none() -> list[str]:
        raise peers.Unavailable("cyclictest is missing")

    monkeypatch.setattr("bench.rounds.cyclictest", none)
    # Counted by tests/cost; under callgrind it would take most of the time.
    monkeypatch.setattr("bench.rounds.instructions.of_ecdaq", lambda slaves: 2000.0)
    monkeypatch.setattr("bench.rounds.instructions.of_peer", lambda *_: 1000.0)
    try:
        bench = Bench(Plan([2], CYCLES, 1))
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    bench.run()
    assert bench.missing[f"round 1, {SLEEP}"] == "cyclictest is missing"
    # Without ptrace, or without strace.
    calls = [what for what in bench.missing if what.endswith("system calls")]
    assert list(bench.missing) == [f"round 1, {SLEEP}", *calls]
    write_json(tmp_path / "json", bench, {"commit": "x"})
    rows = {row["name"]: row for row in json.loads((tmp_path / "json").read_text())["rows"]}
    assert set(rows) == {ECDAQ, "SOEM", ECHO}
    for row in rows.values():
        assert row["cycles"] == CYCLES
        assert 0 < row["round_trip_ns"][0] <= row["round_trip_ns"][3] < 1_000_000
        assert 900_000 < row["interval_ns"][0] < 1_100_000
        assert row["free_run_per_s"] > 500
    for name in (ECDAQ, "SOEM"):
        assert rows[name]["slaves"] == 2
        assert 0.05 < rows[name]["time_to_op_s"] < 60
        assert 0 < rows[name]["sync0_spread_ns"] < 500_000
        assert rows[name]["cycles_lost_per_lost_frame"] >= 1
    text = "\n".join(lines_of(bench))
    assert "cyclictest is missing" in text
    assert "instructions 0.50" in text


def test_the_slaves_of_an_interface_are_taken_as_they_are(
    only_soem: None, make_segment: Callable[..., Segment], tmp_path: Path
) -> None:
    segment = make_segment(slaves="3")
    segment.start_sim()
    work = (
        "import sys; sys.path.insert(0, sys.argv[1]); from pathlib import Path\n"
        "from bench import peers, rounds\n"
        "rounds.PEERS = peers.PEERS[:1]\n"
        "b = rounds.Bench(rounds.Plan([0], 200, 1, 'ecat0')); b.run()\n"
        "print([(r.name, [x.slaves for x in r.runs]) for r in b.rows.values() if r.slaves == 0])\n"
        "print(b.missing)\n"
    )
    command = [*segment.space.enter, sys.executable, "-c", work, str(ROOT / "app" / "tools")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, env=os.environ)
    assert ended.returncode == 0, ended.stderr
    assert f"('{ECDAQ}', [3])" in ended.stdout, ended.stdout + ended.stderr
    assert "('SOEM', [3])" in ended.stdout, ended.stdout + ended.stderr
    assert "only on the simulated segment" in ended.stdout
