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
    shown = json.loads(segment.ecdaq("state", "--json").stdout)
    return {slave["state"] for slave in shown["slave"]}


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
