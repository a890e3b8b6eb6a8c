# SPDX-License-Identifier: MIT
"""ecdaq-sync0 on recorded edges, and its messages when a line is unavailable."""

from __future__ import annotations

import json
import random
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest
from ecdaq import (
    BIN,
    CHECK_FAILED,
    CONFIG,
    FAILED,
    NO_DAEMON,
    USAGE,
    Fake,
    ecdaq,
    environment,
    fails,
    works,
)

CHECK = BIN / "ecdaq-sync0"
PERIOD = 1_000_000
START = 7_000_000_000_000

Edge = tuple[int, int]  # slave, time


def check(*words: str, run_dir: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [CHECK, *words],
        env=environment(run_dir),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def one_line(result: subprocess.CompletedProcess[str], code: int, *output: str) -> None:
    assert result.returncode == code, (result.returncode, result.stderr)
    assert result.stderr.startswith("ecdaq-sync0: ") and result.stderr.count("\n") == 1
    for text in output:
        assert text in result.stderr


def edges(cycles: int, skew: int = 0) -> Iterable[Edge]:
    noise = random.Random(3)
    for cycle in range(cycles):
        for slave in (0, 2):
            late = skew if slave == 2 else 0
            yield slave, START + cycle * PERIOD + late + noise.randrange(-60, 61)


def write(path: Path, what: Iterable[Edge]) -> str:
    path.write_text("# edges\n" + "".join(f"{slave} {at}\n" for slave, at in what))
    return str(path)


def windows(text: str) -> list[dict[str, object]]:
    return [m for m in map(json.loads, text.splitlines()) if m.get("sync0") == "window"]


def test_clean_edges_are_good_and_what_cannot_be_seen_is_unresolved(tmp_path: Path) -> None:
    file = write(tmp_path / "e", edges(12000))
    none = f"sync0.calibration={tmp_path / 'none'}"
    got = check("--replay", file, "--json", "--set", none)
    assert got.returncode == 0 and got.stderr == ""
    found = windows(got.stdout)
    assert [(m["slave"], m["edges"], m["missing"]) for m in found] == [(0, 10000, 0), (2, 10000, 0)]
    assert found[0]["verdict"] == "OK"
    assert found[1]["skew"] == "UNRESOLVED"  # this board is not calibrated
    text = check("--replay", file, "--set", none).stdout
    assert "skew < " in text and "(unresolved)" in text and "0 ns jitter" not in text


def test_a_calibrated_skew_is_found_and_fails(tmp_path: Path) -> None:
    saved = f"sync0.calibration={tmp_path / 'calibration'}"
    same = write(tmp_path / "same", edges(4000, skew=200))
    got = check("--replay", same, "--calibrate", "--set", saved)
    assert got.returncode == 0, got.stderr
    found = re.search(r"second line behind the first: (\d+) ns, \+-(\d+) ns", got.stdout)
    assert found and abs(int(found[1]) - 200) <= int(found[2]) < 20
    late = write(tmp_path / "late", edges(12000, skew=15000))
    got = check("--replay", late, "--json", "--set", saved)
    assert got.returncode == CHECK_FAILED
    (skewed,) = [m for m in windows(got.stdout) if m["slave"] == 2]
    assert skewed["skew"] == "FAIL"
    assert abs(int(str(skewed["skew_ns"])) - 15000) <= int(str(skewed["skew_error_ns"]))
    assert any('"event":"sync0_skew","slave":2' in line for line in got.stdout.splitlines())


def test_a_missing_pulse_is_named_by_slave_and_cycle(tmp_path: Path) -> None:
    gap = (2, START + 5000 * PERIOD)
    kept = [e for e in edges(12000) if not (e[0] == 2 and abs(e[1] - gap[1]) < PERIOD / 2)]
    got = check("--replay", write(tmp_path / "e", kept))
    assert got.returncode == CHECK_FAILED
    assert "! slave 2, line 2: cycle 5000: SYNC0 missing, 1 in a row" in got.stdout


def shots(cycles: int, due: list[int], came: list[int]) -> Iterable[str]:
    """A dump: slave 0 is periodic, slave 1 in one-shot mode."""
    for cycle in range(cycles):
        dc, at = 845 * 10**15 + cycle * PERIOD, START + cycle * PERIOD
        yield f"c {cycle} {dc} {dc + 500_000} {at + 500_000} 10000 12 1"
        yield from (f"s 1 {dc} {845 * 10**15 + d * PERIOD}" for d in due if d == cycle + 100)
        yield f"0 {at} 0 {cycle + 1}"
        yield from (f"1 {at} 0 {n + 1}" for n, c in enumerate(came) if c == cycle)


def test_recorded_shots_are_checked_against_their_commands(tmp_path: Path) -> None:
    file = tmp_path / "dump"
    file.write_text("\n".join(shots(12000, due=[2000, 5000, 11500], came=[2000, 11500])) + "\n")
    got = check("--replay", str(file), "--json")
    assert got.returncode == CHECK_FAILED, got.stderr
    output = [json.loads(line) for line in got.stdout.splitlines()]
    reported = [(m["event"], m["value"] - 845 * 10**15) for m in output if "event" in m]
    lost = ("sync0_shot_lost", 5000 * PERIOD)
    shot = [("sync0_shot", c * PERIOD) for c in (2000, 11500)]
    assert reported == [shot[0], lost, shot[1]]
    assert [(m["slave"], m["edges"], m["missing"]) for m in windows(got.stdout)] == [(0, 10000, 0)]
    file.write_text("\n".join(shots(12000, due=[2000], came=[2000])) + "\n")
    assert check("--replay", str(file)).returncode == 0


def dumped(cycles: int, shift: int, *line: str) -> Iterable[str]:
    """A dump: SYNC0 of slave 0 in every cycle, that of slave 1 in every second one, shifted."""
    yield from line
    for cycle in range(cycles):
        dc, at = 845 * 10**15 + cycle * PERIOD, START + cycle * PERIOD
        yield f"0 {at} 0 {cycle + 1}"
        if cycle % 2 == 0:
            yield f"1 {at + shift} 0 {cycle // 2 + 1}"
        yield f"c {cycle} {dc} {dc + 500_000} {at + 500_000} 10000 12 1"


def test_recorded_cycle_shift_and_name_are_taken_and_not_those_of_the_position(
    tmp_path: Path,
) -> None:
    file = tmp_path / "dump"
    line = "l 1 0 2000000 300000 drive"
    file.write_text("\n".join(dumped(12000, 300_000, line)) + "\n")
    settings = ("slaves[0].mode=periodic", "slaves[1].sync0_shift=-200us", "slaves[1].mode=oneshot")
    other = [word for setting in settings for word in ("--set", setting)]
    got = check("--replay", str(file), "--json", *other)
    assert got.returncode == 0, got.stdout + got.stderr
    assert [(m["slave"], m["edges"], m["missing"], m["extra"]) for m in windows(got.stdout)] == [
        (0, 10000, 0, 0),
        (1, 5000, 0, 0),
    ]
    (told,) = [m for m in map(json.loads, got.stdout.splitlines()) if m.get("sync0") == "line"]
    assert told == {
        "sync0": "line",
        "slave": 1,
        "name": "drive",
        "cycle_ns": 2000000,
        "shift_ns": 300000,
    }
    assert "slave 1 (drive): SYNC0 cycle 2000000 ns" in check("--replay", str(file)).stdout
    file.write_text("\n".join(dumped(12000, 300_000)) + "\n")
    assert check("--replay", str(file)).returncode == CHECK_FAILED  # every second one is missing


def test_slaves_of_a_recording_beyond_the_lines_are_named(tmp_path: Path) -> None:
    many = ((slave, START + cycle * PERIOD) for cycle in range(2000) for slave in range(66))
    got = check("--replay", write(tmp_path / "e", many), "--set", "sync0.window=1s")
    assert got.returncode == 0
    assert "not checked: the edges of 2 slaves behind slave 63: only 64 lines" in got.stderr


def test_an_empty_or_foreign_file_is_refused_in_one_line(tmp_path: Path) -> None:
    one_line(check("--replay", str(tmp_path / "none")), FAILED, "No such file")
    (tmp_path / "empty").write_text("# nothing\n")
    one_line(check("--replay", str(tmp_path / "empty")), FAILED, "holds no edge")
    (tmp_path / "text").write_text("0 5\nSYNC0 was fine\n")
    one_line(check("--replay", str(tmp_path / "text")), FAILED, "text:2:", "SLAVE MONO_NS")
    short = write(tmp_path / "short", edges(100))
    one_line(check("--replay", short), FAILED, "too short", "sync0.window")
    one_line(check("--replay", short, "--calibrate"), FAILED, "too few")
    one_line(check("--replay", str(tmp_path)), FAILED, "Is a directory")
    one_line(check("--replay", "/dev/null"), FAILED, "no regular file")
    mixed = write(tmp_path / "mixed", sorted(edges(2000), key=lambda e: e[1] % 7))
    one_line(check("--replay", mixed, "--calibrate"), FAILED, "not in order of time")
    same = write(tmp_path / "same", edges(2000))
    nowhere = f"sync0.calibration={tmp_path / 'none' / 'calibration'}"
    unsaved = check("--replay", same, "--calibrate", "--set", nowhere)
    one_line(unsaved, FAILED, "none/calibration: No such file or directory")


def test_mistakes_on_the_command_line_are_one_line(tmp_path: Path) -> None:
    one_line(check("--nonsense"), USAGE, "--nonsense")
    one_line(check("word"), USAGE, "word: unexpected argument")
    one_line(check("--replay"), USAGE, "--replay: missing value")
    one_line(check("--json"), USAGE, "--json: requires --replay")
    one_line(check("--replay", "x", "--dump", "y"), USAGE, "--dump: cannot be combined with")
    one_line(check("--calibrate", "--edges", "y"), USAGE, "--edges: cannot be combined with")
    same = ["--set", "slaves[0].sync0_line=A", "--set", "slaves[1].sync0_line=A"]
    one_line(check(*same), CONFIG, "sync0_line: is already used by slave 0")
    one_line(check("--set", "sync0.windw=1s"), CONFIG, "sync0.window")
    one_line(check("--set", "sync0.window=1h"), CONFIG, "sync0.window")
    one_line(check("--set", "sync0.enable=on"), CONFIG, "slaves[].sync0_line")
    off = check()
    assert off.returncode == 0 and "sync0.enable is off" in off.stderr
    assert "usage: ecdaq-sync0" in check("--help").stdout


def wait_for_message(run_dir: Path) -> dict[str, Any]:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        got = ecdaq(run_dir, "sync0", "--json")
        report: dict[str, Any] = json.loads(got.stdout) if got.returncode == 0 else {}
        if report.get("message"):
            return report
        time.sleep(0.02)
    raise AssertionError("ecdaq-sync0 printed nothing")


def test_an_unavailable_line_is_reported_once_and_retried(run_dir: Path) -> None:
    options = ["--set", "sync0.enable=on", "--set", "slaves[0].sync0_line=pinctrl-none:17"]
    dev = run_dir / "dev"
    dev.mkdir()
    process = subprocess.Popen(
        [CHECK, "--run-dir", str(run_dir), "--dev-dir", str(dev), *options],
        env=environment(None),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        report = wait_for_message(run_dir)
        assert "line 'pinctrl-none:17' of slave 0: this machine has no GPIO" in report["message"]
        assert report["lines"][0]["open"] is False
        assert "NOT OPEN" in works(ecdaq(run_dir, "sync0"))
        assert process.poll() is None
    finally:
        process.send_signal(signal.SIGTERM)
        _, output = process.communicate(timeout=60)
    assert process.returncode == 0
    assert output.count("this machine has no GPIO chip") == 1
    assert "(not running)" in works(ecdaq(run_dir, "sync0"))
    dev.rmdir()


def test_without_ecdaq_sync0_the_verb_reports_it(run_dir: Path) -> None:
    fails(ecdaq(run_dir, "sync0"), NO_DAEMON, "is ecdaq-sync0 running?")
    fails(ecdaq(run_dir, "sync0", "measure"), USAGE, "calibrate")
    fails(ecdaq(run_dir, "sync0", "--json", "--histogram"), USAGE, "exclude each other")
    fails(ecdaq(run_dir, "sync0", "calibrate", "--json"), USAGE, "not supported")


def test_slaves_that_have_no_line_are_named(fake: Callable[..., Fake]) -> None:
    run_dir = fake("BEYOND=3").run_dir
    text = works(ecdaq(run_dir, "sync0"))
    assert "not checked: slave 64 (valve7) and 2 more: only 64 lines" in text
    assert json.loads(works(ecdaq(run_dir, "sync0", "--json")))["beyond"] == 3
    assert "not checked" not in works(ecdaq(fake("BEYOND=0").run_dir, "sync0"))


def test_a_calibration_needs_two_lines(tmp_path: Path) -> None:
    config = tmp_path / "ecdaq.yaml"
    config.write_text("slaves:\n  - sync0_line: pinctrl-none:1\n")
    got = ecdaq(None, "--config", str(config), "sync0", "calibrate")
    assert got.returncode != 0 and "the same signal on two lines" in got.stderr
    config.write_text("slaves:\n  - sync0_line: x-none:1\n  - sync0_line: x-none:2\n")
    got = ecdaq(None, "--config", str(config), "sync0", "calibrate")
    assert got.returncode == FAILED and got.stderr.count("\n") == 1
    assert "line 'x-none:" in got.stderr


@pytest.mark.parametrize("content", [b"", b"cdq", b"\0" * 5000])
def test_a_damaged_status_page_is_refused(run_dir: Path, content: bytes) -> None:
    (run_dir / "sync0").mkdir()
    (run_dir / "sync0/status").write_bytes(content)
    fails(ecdaq(run_dir, "sync0"), FAILED, "another version of ecdaq, or damaged")
