# SPDX-License-Identifier: MIT
"""ecdaq config reload and SIGHUP: what is taken while the bus runs, and what is named."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from segment import Segment, wait_for

CONFIG_ERROR = 3
NAMES = "slaves:\n  - {name: front}\n  - {name: rear}\n"


def outputs(limit: str, fail_safe: int = 0) -> str:
    return (
        "outputs:\n"
        f"  - {{channel: front.oneshot_time, max: {limit}, fail_safe: {fail_safe}}}\n"
        "  - {channel: rear.led}\n"
    )


def in_op(make_segment: Callable[..., Segment]) -> tuple[Segment, Path]:
    segment = make_segment()
    file = segment.folder / "ecdaq.yaml"
    file.write_text(NAMES + outputs("1000"))
    segment.start_sim()
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    return segment, file


def reload(segment: Segment) -> dict[str, dict[str, Any]]:
    return {c["option"]: c for c in json.loads(segment.ecdaq("config", "reload", "--json").stdout)}


def test_limits_and_time_outs_are_taken_and_the_cycle_goes_on(
    make_segment: Callable[..., Segment],
) -> None:
    segment, file = in_op(make_segment)
    before = segment.status()
    assert "outside" in segment.ecdaq("set", "front.oneshot_time=2000", check=False).stderr
    file.write_text(
        NAMES
        + outputs("3000")
        + "bus: {op_timeout: 7s, watchdog: 200ms}\ncycle: {period: 2ms}\nrecord: {budget: 1GiB}\n"
    )
    shown = segment.ecdaq("config", "reload").stdout.splitlines()
    assert shown == [
        "bus.op_timeout: 10s -> 7s: in effect",
        "bus.watchdog: 100ms -> 200ms: needs a rescan",
        "cycle.period: 1ms -> 2ms: needs a restart of ecdaqd",
        "record.budget: 8GiB -> 1GiB: needs a restart of ecdaq-record",
        "outputs[0].max: 1000 -> 3000: in effect",
    ]
    assert f"ecdaqd: reload: {shown[0]}" in segment.log("daemon")
    segment.ecdaq("set", "front.oneshot_time=2000")
    # What is in effect, or was named to its service, is not named again.
    assert reload(segment).keys() == {"bus.watchdog", "cycle.period"}
    after = segment.wait_for_cycles(100, 60)
    assert (after["pid"], after["session"], after["state"]) == (
        before["pid"],
        before["session"],
        "OP",
    )
    assert segment.stop("daemon") == 0


def test_a_rescan_takes_what_needs_one(make_segment: Callable[..., Segment]) -> None:
    segment, file = in_op(make_segment)
    file.write_text(NAMES.replace("front", "first") + "bus: {target: preop}\n")
    changed = reload(segment)
    assert changed["slaves[0].name"] == {
        "option": "slaves[0].name",
        "old": "front",
        "new": "first",
        "in_effect": False,
        "needs": "rescan",
    }
    assert changed["outputs[0]"]["new"] == "none"
    assert "front.adc" in segment.ecdaq("channels").stdout
    segment.ecdaq("rescan", "--force")
    wait_for("PREOP", lambda: segment.status()["state"] == "PREOP", 60)
    assert segment.status()["target"] == "PREOP"
    slaves = [
        slave["name"] for slave in json.loads(segment.ecdaq("state", "--json").stdout)["slave"]
    ]
    assert slaves == ["first", "rear"]
    assert segment.ecdaq("config", "reload").stdout == f"{file}: no option has another value\n"
    assert segment.stop("daemon") == 0


def test_a_file_with_an_error_changes_nothing(make_segment: Callable[..., Segment]) -> None:
    segment, file = in_op(make_segment)
    file.write_text(NAMES + "bus: {op_timeout: 7s}\ncycle: {perid: 1ms}\n")
    got = segment.ecdaq("config", "reload", check=False)
    assert (got.returncode, got.stdout) == (CONFIG_ERROR, "")
    assert f"{file}:5: cycle.perid: unknown option" in got.stderr
    assert len(got.stderr.splitlines()) == 1
    # A fail-safe value that the channel cannot hold: all or nothing.
    file.write_text(NAMES + outputs("3000", -1) + "bus: {op_timeout: 7s}\n")
    got = segment.ecdaq("config", "reload", check=False)
    assert (got.returncode, got.stdout) == (CONFIG_ERROR, "")
    assert "outputs: front.oneshot_time: the channel cannot hold its fail_safe" in got.stderr
    assert "outside" in segment.ecdaq("set", "front.oneshot_time=2000", check=False).stderr
    file.unlink()
    got = segment.ecdaq("config", "reload", check=False)
    assert got.returncode == CONFIG_ERROR
    assert f"{file}: cannot read" in got.stderr
    file.write_text(NAMES + outputs("1000"))
    assert reload(segment) == {}
    assert segment.status()["state"] == "OP"
    assert segment.stop("daemon") == 0


def test_sighup_does_the_same_and_the_journal_has_it(make_segment: Callable[..., Segment]) -> None:
    segment, file = in_op(make_segment)
    file.write_text(NAMES + outputs("3000"))
    segment.send("daemon", signal.SIGHUP)
    line = "ecdaqd: reload: outputs[0].max: 1000 -> 3000: in effect"
    wait_for("the change in the log", lambda: line in segment.log("daemon"), 60)
    segment.ecdaq("set", "front.oneshot_time=2000")
    file.write_text("cycle: {perid: 1ms}\n")
    segment.send("daemon", signal.SIGHUP)
    wait_for(
        "the error in the log",
        lambda: f"reload: {file}:1: cycle.perid: unknown option" in segment.log("daemon"),
        60,
    )
    assert segment.status()["state"] == "OP"
    assert segment.stop("daemon") == 0


def test_a_bus_that_waits_takes_the_mended_file_with_a_rescan(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    file = segment.folder / "ecdaq.yaml"
    file.write_text(NAMES.replace("name: rear", "name: rear, product: 0x99"))
    segment.start_sim()
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 60)
    file.write_text(NAMES)
    assert reload(segment)["slaves[1].product"]["new"] == "0"
    segment.ecdaq("rescan")
    segment.wait_for_op()
    assert segment.stop("daemon") == 0
