# SPDX-License-Identifier: MIT
"""What ecdaq shows of a running ecdaqd."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import NO_DAEMON, OK, Fake, fails, json_lines, json_of, wait_until, works

# What scripts and `build.sh run --json` rely on.
STATUS_KEYS = {
    "state": str,
    "slaves": int,
    "cycles": int,
    "frames_lost": int,
    "frames_late": int,
    "overruns": int,
    "samples_good": int,
    "samples_bad": int,
    "samples_bad_unexplained": int,
    "dc_lock_ms": float,
    "wake_latency_ns": dict,
    "round_trip_ns": dict,
    "phase_ns": dict,
    "page_faults": int,
    "recording": str,
    "recorded_cycles": int,
    "recorded_gaps": int,
}


@pytest.mark.parametrize("words", [["--json"], ["--summary", "--json"]], ids=" ".join)
def test_status_as_json_has_the_keys_that_scripts_rely_on(daemon: Fake, words: list[str]) -> None:
    with daemon.held():
        status = json_of(daemon("status", *words))
    for key, kind in STATUS_KEYS.items():
        assert isinstance(status[key], kind), key
    for key in ("wake_latency_ns", "round_trip_ns", "phase_ns", "work_ns"):
        assert {"p50", "p99", "p999", "max"} <= status[key].keys()
    wake = status["wake_latency_ns"]
    assert 3000 <= wake["p50"] <= wake["p99"] <= wake["p999"] <= wake["max"] <= 13000
    assert status["state"] == "OP"
    assert status["running"] is True
    assert status["slaves"] == 2
    assert status["dc_lock_ms"] == 123.456789
    assert status["recording"] == "/var/lib/ecdaq/a.mcap.part"
    assert status["recorded_cycles"] == 5000
    assert status["wkc_expected"] == 6
    assert status["rt_degraded"] == ["priority"]
    assert status["message"] == 'slave 1: "quoted"\ttext'
    assert status["session"] > 2**53
    # It may be held in the middle of a cycle.
    good = 2 * (status["cycles"] - status["frames_lost"])
    assert abs(status["samples_good"] - good) <= 2


def test_status_lists_the_slaves(daemon: Fake) -> None:
    first, second = json_of(daemon("status", "--json"))["slave"]
    assert first["name"] == "piccolo0" and first["is_dc_reference"] is True
    assert second["state"] == "OP"
    assert second["al_status"] == "SyncManager watchdog"
    assert second["rx_errors"] == [3, 0, 0, 0]
    assert second["forwarded_errors"] == [0, 0, 4, 0]
    assert second["lost_links"] == [0, 255, 0, 0]
    assert second["processing_errors"] == 0 and second["pdi_errors"] == 5
    assert second["errors_incomplete"] is True and first["errors_incomplete"] is False
    assert second["dc_diff_ns"] == -7
    assert second["device"] == "FB1111-Piccolo \ufffd"


def test_status_is_one_screen(daemon: Fake) -> None:
    text = works(daemon("status"))
    assert len(text.splitlines()) <= 24
    for output in (
        "OP",
        "2 slaves on ecat0 (simulated)",
        "WKC ",
        "locked after 123.5 ms",
        "p99.9",
        "wake ",
        "round trip",
        "phase",
        "piccolo0",
        "reference",
        "0x001b SyncManager watchdog",
        "recorder   running   5000 cycles, 1 gaps",
        "not granted: priority",
    ):
        assert output in text


def test_status_shows_the_control_program_where_there_is_one(fake: Callable[..., Fake]) -> None:
    without = fake()
    assert "control" not in works(without("status"))
    assert json_of(without("status", "--json"))["control"] is None
    daemon = fake("CONTROL=5")
    text = works(daemon("status"))
    assert "control    blink: parked   5 calls   2 beyond 200 us" in text
    assert len([line for line in text.splitlines() if line.startswith("control ")]) == 2
    assert "control    blink: parked" in works(daemon("status", "--summary"))
    control = json_of(daemon("status", "--json"))["control"]
    assert control["program"] == "blink" and control["path"] == "/usr/lib/blink.so"
    assert control["state"] == "parked" and control["budget_ns"] == 200000
    assert control["calls"] == 5 and control["overruns"] == 2 and control["safe_cycles"] == 1
    assert control["limited"] == 3 and control["refused"] == 4
    assert control["time_ns"]["count"] == 5 and control["time_ns"]["max"] == 300000
    assert json_of(daemon("histogram", "control", "--json"))["count"] == 5


def test_status_reports_a_missing_recorder(fake: Callable[..., Fake]) -> None:
    daemon = fake("RECORDER=0")
    assert "recorder   none" in works(daemon("status"))
    status = json_of(daemon("status", "--json"))
    assert status["recording"] is None and status["recorder"] is None
    assert status["recorded_cycles"] == 0


@pytest.mark.parametrize("end", [Fake.end, Fake.kill], ids=["in order", "killed"])
def test_status_works_after_the_end_and_is_marked(
    daemon: Fake, end: Callable[[Fake], None]
) -> None:
    end(daemon)
    text = works(daemon("status"))
    assert text.startswith("ecdaqd has ended")
    status = json_of(daemon("status", "--summary", "--json"))
    assert status["running"] is False
    assert status["state"] == "OP"  # as it was when it was stopped
    assert status["cycles"] >= 2000
    assert works(daemon("slaves")).count("piccolo") == 2
    fails(daemon("watch", "piccolo0.adc"), NO_DAEMON, "ecdaqd has ended")


def test_slaves_lists_them(daemon: Fake) -> None:
    lines = works(daemon("slaves")).splitlines()
    assert len(lines) == 2
    assert re.match(r" 1  1001:1  OP +\+ +piccolo1 +FB1111-Piccolo \?$", lines[1])
    assert "product          0x04570862" in works(daemon("slaves", "-v"))
    slaves = json_of(daemon("slaves", "--json"))
    assert [s["product"] for s in slaves] == [0x04570862, 0x04570862]


def test_channels_lists_the_table(daemon: Fake) -> None:
    channels = json_of(daemon("channels", "--json"))
    assert len(channels) == 12
    assert channels[2] == {
        "name": "piccolo0.adc",
        "direction": "input",
        "type": "UINT16",
        "slave": 0,
        "slave_name": "piccolo0",
        "index": 0x6000,
        "subindex": 1,
        "bit_offset": 144,
        "bit_length": 16,
        "unit": "V",
        "scale": 3.3 / 4096,
        "offset": 0,
    }
    text = works(daemon("channels"))
    assert re.search(r"piccolo1\.led +out +BOOL +9\.0 +0x7000:01\n", text)


def test_watch_gives_every_cycle(daemon: Fake) -> None:
    samples = json_lines(daemon("watch", "piccolo0.counter", "--count", "1000", "--json"))
    cycles = [s["cycle"] for s in samples]
    assert cycles == list(range(cycles[0], cycles[0] + 1000))
    assert all(s["dc_time_ns"] == 800000000 * 10**9 + s["cycle"] * 10**6 for s in samples)
    for s in samples:
        is_lost = s["cycle"] % 64 == 0
        assert s["flags"] == (["lost"] if is_lost else [])
        assert s["bad"] == (["piccolo0.counter"] if is_lost else [])


def test_watch_shows_the_sine(daemon: Fake) -> None:
    samples = json_lines(daemon("watch", "piccolo0.adc", "--count", "1000", "--json"))
    for s in samples:
        if not s["bad"]:
            wanted = 1 + 0.5 * math.sin(2 * math.pi * (s["cycle"] % 1000) / 1000)
            assert abs(s["values"]["piccolo0.adc"] - wanted) < 3.3 / 4096


def test_watch_prints_lines_with_marks(daemon: Fake) -> None:
    lines = works(daemon("watch", "piccolo*.adc", "--count", "100")).splitlines()
    assert len(lines) == 101
    assert "piccolo0.adc[V]" in lines[0] and "piccolo1.adc" in lines[0]
    for line in lines[1:]:
        cycle, _, first, second, *flags = line.split()
        assert ("lost" in flags) == (int(cycle) % 64 == 0)
        assert first.endswith("!") == second.endswith("!") == (int(cycle) % 64 == 0)


def test_watch_raw_gives_counts(daemon: Fake) -> None:
    (sample,) = json_lines(daemon("watch", "piccolo0.adc", "--count", "1", "--json", "--raw"))
    assert isinstance(sample["values"]["piccolo0.adc"], int)


def test_watch_reduces_the_rate(daemon: Fake) -> None:
    for words in (["--every", "50"], ["--rate", "20"]):
        samples = json_lines(daemon("watch", "piccolo0.adc", "--count", "4", "--json", *words))
        cycles = [s["cycle"] for s in samples]
        assert [b - a for a, b in itertools.pairwise(cycles)] == [50, 50, 50]


def test_watch_counts_jumps_of_the_cycle_number(fake: Callable[..., Fake]) -> None:
    daemon = fake("SPEED=10", "JUMP=1")
    lines = json_lines(daemon("watch", "piccolo0.adc", "--count", "500", "--json"))
    jumps = [line for line in lines if "missed" in line]
    assert 4 <= len(jumps) <= 6
    assert all(j == {"missed": 5, "why": "the cycle numbers jump"} for j in jumps)
    text = works(daemon("watch", "piccolo0.adc", "--count", "150"))
    assert "# 5 samples missed: the cycle numbers jump" in text


def test_watch_names_an_unknown_channel(daemon: Fake) -> None:
    fails(daemon("watch", "piccolo0.acd"), 1, "piccolo0.acd: no such channel; did you mean pic")
    fails(daemon("watch", "zz*"), 1, "zz*: no such channel (see ecdaq channels)")


def test_watch_ends_when_ecdaqd_ends(daemon: Fake) -> None:
    process = daemon.start("watch", "piccolo0.adc", "--count", "10000000", stdout=-1, stderr=-1)
    assert process.stdout is not None
    process.stdout.readline()
    daemon.end()
    _, output = process.communicate(timeout=60)
    assert process.returncode == NO_DAEMON
    assert re.match(r"ecdaq: watch: ecdaqd has ended after \d+ of 10000000 samples\n$", output)


def test_watch_ends_with_a_signal(daemon: Fake) -> None:
    process = daemon.start("watch", "piccolo0.adc", stdout=-1, stderr=-1)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, output = process.communicate(timeout=60)
    assert (process.returncode, output) == (OK, "")


def plot(daemon: Fake, *words: str, **env: str) -> list[str]:
    window = ["--plot", "--count", "1000", "--window", "1s"]
    size = {"COLUMNS": "92", "LINES": "23"}
    return works(daemon("watch", *words, *window, **(size | env))).splitlines()


def test_a_plot_shows_one_period_of_the_sine(daemon: Fake) -> None:
    lines = plot(daemon, "piccolo1.adc")
    assert len(lines) == 22
    assert re.match(r"piccolo1\.adc   now \d+   min 62\d   max 186\d$", lines[0])
    rows = [line[11:] for line in lines[1:20]]
    # The axis ends at round values: some rows are left.
    assert sum("*" in row for row in rows) >= 14
    # Leftmost and rightmost ends of the highest stroke: one hump of a quarter of the window.
    assert "-1 s" in lines[-1] and "-0.4 s" in lines[-1] and lines[-1].endswith("now")
    columns = [sum(row[i : i + 1] == "*" for row in rows) for i in range(80)]
    assert all(columns), "no column is empty"
    crossings = 0
    middle = len(rows) // 2
    tops = [min(y for y, row in enumerate(rows) if row[i : i + 1] == "*") for i in range(80)]
    for a, b in itertools.pairwise(tops):
        crossings += (a < middle) != (b < middle)
    assert crossings in (1, 2, 3)


def test_a_plot_of_two_channels_has_two_panels(daemon: Fake) -> None:
    lines = plot(daemon, "piccolo?.adc")
    titles = [line for line in lines if line.startswith("piccolo")]
    assert [t.split()[0] for t in titles] == ["piccolo0.adc", "piccolo1.adc"]


def test_a_plot_uses_dots_where_the_terminal_speaks_utf8(daemon: Fake) -> None:
    lines = plot(daemon, "piccolo0.adc", LANG="C.UTF-8")
    assert any("\u2801" <= c <= "\u28ff" for line in lines for c in line)


def test_events_are_listed_oldest_first(daemon: Fake) -> None:
    events = json_lines(daemon("events", "--json"))
    assert [e["event"] for e in events[:2]] == ["started", "slave_lost"]
    assert events[1]["slave"] == 1 and events[1]["severity"] == "error"
    assert events[0]["slave"] is None
    assert re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$", events[0]["utc"])
    text = works(daemon("events", "--level", "error"))
    assert re.match(r"\S+Z  error    slave 1 piccolo1: lost\n$", text)
    assert events[1]["name"] == "piccolo1" and events[0]["name"] is None


def test_events_that_repeat_are_one_line_and_each_with_all_or_json(daemon: Fake) -> None:
    kind = ("--kind", "frame_lost,overrun")
    wait_until(lambda: len(json_lines(daemon("events", "--json", *kind))) >= 3)
    assert {e["event"] for e in json_lines(daemon("events", "--json", *kind))} == {"frame_lost"}
    first, *rest = works(daemon("events", *kind)).splitlines()
    assert re.search(r"Z  warning  \d+ frames lost in \d+\.\d s, cycle \d+ to \d+$", first)
    assert len(rest) < 3  # 10 s each
    lines = works(daemon("events", "--all", *kind)).splitlines()
    assert len(lines) >= 3
    assert all(re.search(r"cycle \d+: frame lost \(1 in a row\)$", line) for line in lines)
    # What does not repeat is before them, as it happened.
    kinds = [line.split("  ")[1].strip() for line in works(daemon("events")).splitlines()]
    assert kinds[:3] == ["info", "error", "warning"]


def test_events_of_one_slave_are_selected_by_its_name(daemon: Fake) -> None:
    for word in ("piccolo1", "1", "alias:1001"):
        lines = json_lines(daemon("events", "--json", "--slave", word))
        assert [(e["event"], e["slave"]) for e in lines] == [("slave_lost", 1)]
    assert works(daemon("events", "--slave", "piccolo0")) == ""
    assert len(works(daemon("events", "--kind", "slave_*")).splitlines()) == 1


def test_events_can_be_followed_to_the_end(daemon: Fake) -> None:
    process = daemon.start("events", "--follow", "--count", "1", "--json", stdout=-1)
    assert process.stdout is not None
    process.stdout.readline()
    daemon.end()
    rest, _ = process.communicate(timeout=60)
    assert process.returncode == OK
    assert json.loads(rest.splitlines()[-1])["event"] == "stopped"


@pytest.mark.parametrize("name", ["wake", "round-trip", "phase", "work", "control"])
def test_histograms_agree_with_their_count(fake: Callable[..., Fake], name: str) -> None:
    daemon = fake("SPEED=1")
    with daemon.held():
        histogram = json_of(daemon("histogram", name, "--json"))
    total = sum(bucket["count"] for bucket in histogram["bucket"])
    # It may be held between a bucket and the count.
    assert abs(total - histogram["count"]) <= 1
    assert (total > 1000) == (name not in ("work", "control"))
    assert all(b["from_ns"] < b["below_ns"] for b in histogram["bucket"])
    text = works(daemon("histogram", name))
    assert ("no values yet" in text) == (name in ("work", "control"))
    assert ("100.0%" in text) == (name not in ("work", "control"))


def test_top_prints_lines_where_there_is_no_terminal(daemon: Fake) -> None:
    lines = works(daemon("top", "--count", "3", "--interval", "20ms")).splitlines()
    assert len(lines) == 4 and lines[0].startswith("state ")
    cycles = [int(line.split()[1]) for line in lines[1:]]
    assert cycles == sorted(cycles)
    assert len(json_lines(daemon("top", "--count", "2", "--interval", "1ms", "--json"))) == 2


def test_the_lines_of_top_follow_the_cycle(daemon: Fake) -> None:
    process = daemon.start("top", "--interval", "20ms", stdout=-1)
    assert process.stdout is not None
    process.stdout.readline()
    first = int(process.stdout.readline().split()[1])
    # At once, unless ecdaqd does not run for a while.
    later = (int(process.stdout.readline().split()[1]) for _ in range(3000))
    assert any(cycle > first for cycle in later)
    process.terminate()
    process.communicate(timeout=60)


def test_top_ends_when_ecdaqd_ends(daemon: Fake) -> None:
    process = daemon.start("top", "--interval", "10ms", stdout=-1)
    assert process.stdout is not None
    process.stdout.readline()
    daemon.end()
    rest, _ = process.communicate(timeout=60)
    assert process.returncode == OK
    assert rest.splitlines()[-1].startswith("STOPPED")


def test_a_summary_marks_no_program_as_not_running(daemon: Fake) -> None:
    daemon.end()
    assert "recorder" in works(daemon("status", "--summary"))
    assert "not running" not in works(daemon("status", "--summary"))
    assert "not running" in works(daemon("status"))


def test_everything_is_read_and_mapped_read_only(daemon: Fake) -> None:
    process = daemon.start("watch", "piccolo0.adc", stdout=subprocess.DEVNULL)
    proc = Path(f"/proc/{process.pid}")

    def modes() -> list[str]:
        """Of what it has mapped or open in the run directory."""
        maps = (proc / "maps").read_text().splitlines()
        found = [line.split()[1] for line in maps if "/ecdaq-cli-" in line]
        for fd in (proc / "fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                if "/ecdaq-cli-" in str(fd.readlink()):
                    flags = (proc / "fdinfo" / fd.name).read_text().split("flags:")[1].split()[0]
                    found.append("r--s" if int(flags, 8) & os.O_ACCMODE == os.O_RDONLY else flags)
        return found

    wait_until(lambda: len(modes()) >= 1)
    assert set(modes()) == {"r--s"}
    process.terminate()
    process.wait(20)


def test_a_stopped_reader_learns_what_it_missed(fake: Callable[..., Fake]) -> None:
    daemon = fake("SPEED=100")
    process = daemon.start("watch", "piccolo0.adc", "--json", "--every", "100", stdout=-1)
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGSTOP)
    before = json_of(daemon("status", "--json"))["cycles"]
    wait_until(lambda: json_of(daemon("status", "--json"))["cycles"] > before + 3 * 65536)
    process.send_signal(signal.SIGCONT)
    # Three times the ring went by: all but its last content is missed, at once or in parts.
    missed = 0
    for line in process.stdout:
        sample = json.loads(line)
        missed += sample.get("missed", 0)
        if sample.get("cycle", 0) > before + 3 * 65536:
            break
    assert missed > 65536
    process.terminate()
    process.wait(20)
    process.stdout.close()
