# SPDX-License-Identifier: MIT
"""ecdaqd without --exit-on-failure: it waits, serves the tool, and goes on when it can."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from segment import Segment, wait_for


def test_it_waits_for_the_first_slave_and_goes_on_by_itself(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(settings={"bus.scan_timeout": "1s", "bus.target": "preop"})
    segment.start_waiting_daemon()

    def is_waiting() -> dict[str, Any]:
        status = segment.status()
        return status if status.get("waiting") else {}

    status = wait_for("waiting", is_waiting, 60)
    assert (status["state"], status["target"], status["link_up"]) == ("DOWN", "PREOP", True)
    assert "no slave answers" in status["message"]
    segment.start_sim()
    wait_for("PREOP", lambda: segment.status()["state"] == "PREOP", 60)
    assert segment.ecdaq("sdo", "read", "0", "0x1018:1").stdout.startswith("0x")
    assert segment.stop("daemon") == 0


def slave_states(segment: Segment) -> set[str]:
    """Also "unknown", until a slave was looked at."""
    return set(states(segment))


def test_start_up_sdos_of_each_transition_and_one_that_is_refused_before_op(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(settings={"bus.presence": "any"})
    file = segment.folder / "ecdaq.yaml"
    file.write_text(
        "slaves:\n  - name: a\n    sdo:\n"
        '      - "IP 0x8000:01 USINT = 0      # mode"\n'
        '      - "PS 0x8000:02 UINT = 11      # refresh time"\n'
        '      - "SO 0x8000:01 USINT = 1      # mode: only in PRE-OP"\n'
    )
    segment.start_sim()
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 120)
    shown = json.loads(segment.ecdaq("state", "--json").stdout)
    assert (shown["state"], shown["target"]) == ("SAFEOP", "OP")
    assert shown["message"] == (
        f"slave 0 (a): start-up SDO 0x8000:01 at SO = 0x1 ({file}:6) rejected: abort 0x08000022, "
        "data cannot be transferred or stored in this state"
    )
    assert segment.ecdaq("sdo", "read", "a", "0x8000:2", "--type", "UINT").stdout.strip() == "11"
    assert segment.stop("daemon") == 0


def test_an_abort_on_the_way_down_is_a_warning(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(settings={"bus.presence": "any"})
    file = segment.folder / "ecdaq.yaml"
    file.write_text("slaves:\n  - name: a\n    sdo: [OS 0x8000:01 USINT = 1]\n")
    segment.start_sim()
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    assert segment.stop("daemon") == 0
    assert (
        f"ecdaqd: warning: slave 0 (a): start-up SDO 0x8000:01 at OS = 0x1 ({file}:3) rejected: "
        "abort 0x08000022" in segment.log("daemon")
    )


def states(segment: Segment) -> list[str]:
    """By position."""
    shown = json.loads(segment.ecdaq("state", "--json").stdout)
    return [slave["state"] for slave in shown["slave"]]


def test_a_group_is_led_to_a_state_by_one_command(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves="3", settings={"bus.target": "preop"})
    file = segment.folder / "ecdaq.yaml"
    file.write_text("slaves: [{name: a, group: pair}, {name: b}, {name: c, group: pair}]\n")
    segment.start_sim()
    segment.start_daemon("--config", str(file))
    wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 120)
    segment.ecdaq("state", "INIT", "@pair")

    wait_for("both in INIT", lambda: states(segment) == ["INIT", "PRE-OP", "INIT"], 60)
    assert segment.stop("daemon") == 0


def test_a_refused_start_up_sdo_can_be_looked_into(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(settings={"bus.presence": "any"})
    file = segment.folder / "ecdaq.yaml"
    file.write_text(
        "slaves:\n  - name: a\n    sdo:\n"
        "      - { index: 0x9999, subindex: 1, type: USINT, value: 1 }\n"
    )
    segment.start_sim()
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 60)
    shown = json.loads(segment.ecdaq("state", "--json").stdout)
    assert (shown["state"], shown["target"]) == ("PREOP", "OP")
    assert "0x9999" in shown["message"]
    wait_for("PRE-OP", lambda: slave_states(segment) == {"PRE-OP"}, 60)
    assert segment.ecdaq("sdo", "read", "a", "0x1018:1").stdout.startswith("0x")
    segment.ecdaq("state", "INIT", "a")
    got = segment.ecdaq("rescan", check=False)
    assert got.returncode == 17
    assert "0x9999" in got.stderr
    assert segment.stop("daemon") == 0


def test_one_slave_of_a_bus_in_preop_is_led_to_safeop_alone(
    make_segment: Callable[..., Segment],
) -> None:
    """With its SyncManagers, start-up SDOs and PDOs; the others stay where they are."""
    segment = make_segment(
        slaves="el3104,el1004,gauge,fb1111_piccolo",
        settings={"bus.target": "preop", "dc.enable": "off"},
    )
    file = segment.folder / "ecdaq.yaml"
    file.write_text(
        "slaves:\n  - name: volts\n    pdos: [0x1a02, 0x1a00]\n  - name: buttons\n  - name: gauge\n"
        "    sdo: [PS 0x9999:01 USINT = 1]\n  - name: piccolo\n"
    )
    segment.start_sim()
    segment.start_daemon("--config", str(file))
    wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 120)

    wait_for("all in PRE-OP", lambda: set(states(segment)) == {"PRE-OP"}, 60)
    early = segment.ecdaq("channels", check=False)
    assert (early.returncode, early.stderr) == (
        16,
        "ecdaq: channels: the bus is PREOP: process data are there from SAFE-OP on (ecdaq state)\n",
    )
    segment.ecdaq("state", "SAFEOP", "buttons", "volts")
    wait_for(
        "two in SAFE-OP", lambda: states(segment) == ["SAFE-OP", "SAFE-OP", "PRE-OP", "PRE-OP"], 60
    )
    assigned = [segment.ecdaq("sdo", "read", "volts", f"0x1c13:{i}").stdout for i in (0, 1, 2)]
    assert [int(text.split()[-1]) for text in assigned] == [2, 0x1A02, 0x1A00]
    for name, why in (
        ("gauge", "slave 2 (gauge): start-up SDO 0x9999:01 at PS = 0x1"),
        ("piccolo", "slave 3 (piccolo): refuses SAFE-OP and is in PRE-OP: AL status code 0x0030"),
    ):
        refused = segment.ecdaq("state", "SAFEOP", name, check=False)
        assert (refused.returncode, why in refused.stderr) == (17, True)
    segment.ecdaq("state", "PREOP", "volts", "piccolo")
    segment.ecdaq("state", "SAFEOP", "volts")
    segment.ecdaq("state", "OP", "buttons")
    wait_for("one in OP", lambda: states(segment) == ["SAFE-OP", "OP", "PRE-OP", "PRE-OP"], 60)
    segment.ecdaq("state", "PREOP")
    wait_for("all in PRE-OP", lambda: set(states(segment)) == {"PRE-OP"}, 60)
    assert segment.stop("daemon") == 0
