# SPDX-License-Identifier: MIT
"""What ecdaq shows of ports, cyclic frames and process image, on a real ecdaqd."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import Segment, wait_for

# Two couplers; the first has two terminals, the second one: a branch at each.
SLAVES = "ek1100(el2828,el3104),ek1100(el2004)"


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    """The five slaves in OP."""
    try:
        segment = Segment(tmp_path_factory.mktemp("views"), slaves=SLAVES)
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    try:
        segment.start_sim()
        segment.start_daemon()
        segment.wait_for_op()
        yield segment
    finally:
        segment.close()


def show(bus: Segment, *words: str) -> Any:
    got = bus.ecdaq(*words, "--json", check=False)
    assert (got.returncode, got.stderr) == (0, "")
    return json.loads(got.stdout)


def check_tree(slaves: list[dict[str, Any]]) -> None:
    assert [slave["parent"] for slave in slaves] == [None, 0, 1, 0, 3]
    for slave in slaves[1:]:
        parent = slaves[slave["parent"]]
        assert slave["parent_port"] in parent["open_ports"]
        assert slave["parent_port"] != parent["port"]
    assert slaves[1]["parent_port"] != slaves[3]["parent_port"]


def test_the_tree_is_the_one_that_is_cabled(bus: Segment) -> None:
    slaves = show(bus, "topology")
    check_tree(slaves)
    assert {slave["state"] for slave in slaves} == {"OP"}
    delays = [slave["clock_delay_ns"] for slave in slaves if slave["clock_delay_ns"] is not None]
    assert delays == sorted(delays) and sum(slave["dc_reference"] for slave in slaves) == 1
    assert all(slave["cable_ns"] is None or 0 < slave["cable_ns"] < 10000 for slave in slaves)
    text = bus.ecdaq("topology").stdout.splitlines()
    assert len(text) == 1 + 5 and max(map(len, text)) <= 80
    assert bus.ecdaq("topology", "--dot").stdout.count(" -> ") == 5


def test_what_the_slaves_add_is_what_is_expected_and_measured(bus: Segment) -> None:
    def shown() -> Any:
        found = show(bus, "domains")
        logical = [d for d in found["datagram"] if d["command"] in ("LRW", "LRD", "LWR")]
        return found if all(d["expected"] == d["measured"] for d in logical) else None

    found = wait_for("all working counters", shown, 60)
    adds: dict[int, int] = {}
    for slave in found["slave"]:
        assert all(sm["active"] for sm in slave["sync_manager"] if not sm["mailbox"])
        for one in slave["wkc"]:
            adds[one["datagram"]] = adds.get(one["datagram"], 0) + one["adds"]
    for number, datagram in enumerate(found["datagram"]):
        if datagram["command"] in ("LRW", "LWR", "LRD") and datagram["length"] > 0:
            assert adds[number] == datagram["expected"]
    assert any(d["command"] == "LRW" for d in found["datagram"])


def test_an_eeprom_is_shown_as_the_bus_uses_it(bus: Segment) -> None:
    for slave in show(bus, "slaves"):
        found = show(bus, "sii", "show", str(slave["position"]))
        for key in ("vendor", "product", "revision"):
            assert found[key] == slave[key]
        assert found["checksum_ok"] and found["name"] == slave["device"]
        for direction in ("input", "output"):
            bits = [
                entry["bits"]
                for pdo in found["pdo"]
                if pdo["sync_manager"] is not None and pdo["direction"] == direction
                for entry in pdo["entry"]
            ]
            assert sum(bits) == slave[f"{direction}_bits"]
    text = bus.ecdaq("sii", "show", "2").stdout
    assert "TxPDO 0x1a00" in text and "0x6000:11  16 bit  Value" in text
    assert max(len(line) for line in text.splitlines()) <= 80


def test_outputs_that_were_set_are_in_the_image(bus: Segment) -> None:
    outputs = [c for c in show(bus, "channels") if c["direction"] == "output"]
    channel = outputs[-1]
    bus.ecdaq("set", f"{channel['name']}=1", "--raw")

    def is_set() -> bool:
        (area,) = [a for a in show(bus, "data")["area"] if a["direction"] == "output"]
        image = bytes.fromhex(area["bytes"])
        return bool(image[channel["bit_offset"] // 8] >> channel["bit_offset"] % 8 & 1)

    wait_for("the output in the image", is_set, 60)
    assert channel["name"].replace(".", "_") in bus.ecdaq("cstruct").stdout


def test_all_but_the_image_is_shown_below_op(
    make_segment: Callable[..., Segment], tmp_path: Path
) -> None:
    segment = make_segment(slaves=SLAVES, settings={"bus.target": "preop"})
    segment.start_sim()
    segment.start_waiting_daemon()
    wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 60)

    def slaves_in_preop() -> Any:
        slaves = show(segment, "topology")
        return slaves if {slave["state"] for slave in slaves} == {"PRE-OP"} else None

    check_tree(wait_for("PRE-OP", slaves_in_preop, 60))
    found = show(segment, "domains")
    assert all(datagram["measured"] is None for datagram in found["datagram"])
    assert len(found["slave"]) == 5
    coupler, terminal = [False, True, False, False], [True, True, False, False]
    ebus = [[port["ebus"] for port in slave["port"]] for slave in show(segment, "crc")]
    assert ebus == [coupler, terminal, terminal, coupler, terminal]
    got = segment.ecdaq("data", check=False)
    assert got.returncode == 16 and got.stderr.count("\n") == 1
