# SPDX-License-Identifier: MIT
"""The cyclic frames, and what each slave adds to their working counters."""

from __future__ import annotations

import json

from ecdaq import FAILED, REFUSED, Fake, fails, json_of, works


def test_datagrams_are_shown_with_expected_and_measured_working_counter(daemon: Fake) -> None:
    lines = works(daemon("domains", "piccolo0")).splitlines()
    assert lines[0].split() == [
        *["datagram", "frame", "command", "address", "bytes", "expected", "measured"]
    ]
    assert lines[1].split() == ["0", "0", "LRW", "0x00000000", "44", "6", "3"]
    assert lines[2].split() == ["1", "0", "FRMW", "0x1001:0x0910", "8", "-", "2"]
    assert lines[3:] == [
        "  0 piccolo0",
        "    SM 0     outputs  128 bytes at 0x1000, mailbox",
        "    SM 1     inputs   128 bytes at 0x1080, mailbox",
        "    SM 2     outputs  9 bytes at 0x1100, watchdog",
        "    SM 3     inputs   13 bytes at 0x1180, switched off",
        "    FMMU 0   outputs  0x00000000.0 to 0x00000008.7 at 0x1100.0",
        "    FMMU 1   inputs   0x00000012.0 to 0x0000001e.7 at 0x1180.0",
        "    adds 3 to datagram 0",
    ]
    assert max(len(line) for line in lines) <= 80


def test_the_same_as_json(daemon: Fake) -> None:
    shown = json_of(daemon("domains", "0", "--json"))
    assert shown["datagram"] == [
        {
            "frame": 0,
            "command": "LRW",
            "logical": 0,
            "length": 44,
            "expected": 6,
            "measured": 3,
        },
        {
            "frame": 0,
            "command": "FRMW",
            "station": 0x1001,
            "register": 0x0910,
            "length": 8,
            "expected": None,
            "measured": 2,
        },
    ]
    (slave,) = shown["slave"]
    assert (slave["position"], slave["name"]) == (0, "piccolo0")
    assert slave["wkc"] == [{"datagram": 0, "adds": 3}]
    assert [sm["active"] for sm in slave["sync_manager"]] == [True, True, True, False]
    assert slave["fmmu"][1] == {
        "number": 1,
        "logical": 18,
        "length": 13,
        "start_bit": 0,
        "stop_bit": 7,
        "physical": 0x1180,
        "physical_bit": 0,
        "read": True,
        "write": False,
    }


def test_a_slave_that_does_not_answer_does_not_keep_the_others_from_it(daemon: Fake) -> None:
    result = daemon("domains", "1", "0", "--json")
    fails(result, REFUSED, "slave 1:", "does not answer")
    assert [slave["position"] for slave in json.loads(result.stdout)["slave"]] == [0]
    fails(daemon("domains", "x"), FAILED, "x: no slave of this name")
