# SPDX-License-Identifier: MIT
"""The verbs for the mailboxes of slaves, on a real ecdaqd: in OP, and in PRE-OP and SAFE-OP."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import Segment, Undisturbed, wait_for

REFUSED, USAGE = 17, 2
PROTOCOLS_BYTE, ALL_PROTOCOLS = 0x38, 0x3F
# 0: EoE, CoE, FoE; 1: every protocol; 2: no mailbox; 3: CoE with SDO information, FoE.
SLAVES = "akd,every,el2004,el3104"


def make_drive(folder: Path) -> Path:
    """A folder with the EEPROM of a drive that has every mailbox protocol."""
    try:
        segment = Segment(folder, slaves="akd", settings={"bus.target": "preop"})
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    try:
        segment.start_sim()
        segment.start_daemon()
        wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 60)
        segment.ecdaq("sii", "read", "0", "--output", str(folder / "every.bin"))
    finally:
        segment.close()
    image = bytearray((folder / "every.bin").read_bytes())
    assert image[PROTOCOLS_BYTE] != ALL_PROTOCOLS
    image[PROTOCOLS_BYTE] = ALL_PROTOCOLS
    (folder / "every.bin").write_bytes(image)
    return folder


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    """The four slaves in OP."""
    sii = make_drive(tmp_path_factory.mktemp("sii"))
    segment = Segment(tmp_path_factory.mktemp("mailboxes"), slaves=SLAVES)
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        yield segment
    finally:
        segment.close()


def run(bus: Segment, *words: str) -> str:
    got = bus.ecdaq(*words, check=False)
    assert (got.returncode, got.stderr) == (0, "")
    return got.stdout


def show(bus: Segment, *words: str) -> Any:
    return json.loads(run(bus, *words, "--json"))


def fails(bus: Segment, code: int, message: str, *words: str) -> None:
    """One line, with the slave's position and name where it is the slave that refuses."""
    got = bus.ecdaq(*words, check=False)
    assert got.returncode == code, got.stderr
    assert got.stderr.startswith("ecdaq: ") and got.stderr.count("\n") == 1
    assert message in got.stderr


def lines_of(bus: Segment, *words: str) -> list[str]:
    """They fit a terminal."""
    lines = run(bus, *words).splitlines()
    assert lines and max(len(line) for line in lines) <= 80
    assert not any(line.endswith(" ") for line in lines)
    return lines


def test_an_object_is_read_and_written_as_a_whole(bus: Segment) -> None:
    assert run(bus, "sdo", "read", "3", "0x1018", "--complete") == (
        "04 00 02 00 00 00 52 30 20 0c 00 00 10 00 00 00 00 00\n"
    )
    shown = show(bus, "sdo", "read", "3", "0x1018:1", "--complete")
    assert shown["bytes"] == "02 00 00 00 52 30 20 0c 00 00 10 00 00 00 00 00"
    assert (shown["slave"], shown["index"], shown["subindex"]) == (3, 0x1018, 1)
    single = show(bus, "sdo", "read", "3", "0x1018:2")
    assert single["value"] == 0x0C203052
    words = ["sdo", "write", "3", "0x1018", "04 00", "--complete"]
    fails(bus, REFUSED, "slave 3 (el3104_3): SDO write of 0x1018:00, complete access: ", *words)
    fails(bus, USAGE, "expected subindex 0 or 1", "sdo", "read", "3", "0x1018:2", "--complete")


def test_the_object_dictionary_is_listed_with_its_entries(bus: Segment) -> None:
    lines = lines_of(bus, "sdo", "list", "el3104_3")
    assert lines[lines.index("0x1018 record") + 2] == "  :01    UDINT            32  rrr---"
    listed = [json.loads(line) for line in run(bus, "sdo", "list", "3", "--json").splitlines()]
    assert [one["index"] for one in listed] == sorted({one["index"] for one in listed})
    identity = next(one for one in listed if one["index"] == 0x1018)
    assert (identity["code"], identity["slave"]) == ("record", 3)
    assert [entry["subindex"] for entry in identity["entry"]] == [0, 1, 2, 3, 4]
    assert identity["entry"][1] == {
        "subindex": 1,
        "name": "",
        "type": "UDINT",
        "bits": 32,
        "access": "rrr---",
        "rxpdo": False,
        "txpdo": False,
    }
    names = {entry["name"] for one in listed for entry in one["entry"]}
    assert "Value" in names
    shown = next(line for line in lines if line.endswith("  Value"))
    assert shown.split() == [":11", "INT", "16", "rrr---", "Value"]


def test_a_slave_without_sdo_information_is_reported_as_such(bus: Segment) -> None:
    fails(bus, REFUSED, "slave 0 (akd0): list of objects: ", "sdo", "list", "0")
    fails(bus, REFUSED, "the slave has no SDO information", "sdo", "list", "akd0")
    fails(bus, REFUSED, "slave 2 (el2004_2): list of objects: ", "sdo", "list", "2")
    fails(bus, USAGE, "list: has no option --type", "sdo", "list", "3", "--type", "UINT")


def test_parameters_of_a_drive_are_listed_and_read(bus: Segment) -> None:
    assert lines_of(bus, "soe", "list", "1")[:2] == [
        "S-0-0001  Control unit cycle time (us)",
        "S-0-0017  IDN list of all operation data",
    ]
    listed = [json.loads(line) for line in run(bus, "soe", "list", "1", "--json").splitlines()]
    assert [one["idn"] for one in listed][-2:] == ["S-0-0099", "P-0-0001"]
    assert lines_of(bus, "soe", "read", "1", "1") == [
        "S-0-0001   Control unit cycle time",
        "attribute  0x00110001: 2 bytes, unsigned",
        "unit       us",
        "minimum    250",
        "maximum    10000",
        "value      1000",
    ]
    assert show(bus, "soe", "read", "1", "s-0-0040", "--drive", "2") == {
        "slave": 1,
        "drive": 2,
        "idn": "S-0-0040",
        "number": 40,
        "name": "Velocity feedback value 1",
        "attribute": 0x00220001,
        "unit": "1/min",
        "minimum": 0,
        "maximum": 0,
        "value": -1234,
    }
    assert show(bus, "soe", "read", "1", "30")["value"] == "ecdaq simulated drive 1.0"
    assert show(bus, "soe", "read", "1", "17")["value"] == [one["idn"] for one in listed]
    table = show(bus, "soe", "read", "1", "P-0-0001")["value"]
    assert table == [i * i for i in range(300)]
    wrapped = " ".join(lines_of(bus, "soe", "read", "1", "0x8001")[2:]).split()
    assert [int(word) for word in wrapped[1:]] == table


def test_parameters_of_a_drive_are_written_as_their_attribute_says(bus: Segment) -> None:
    for value in ("2000", "1000"):
        assert run(bus, "soe", "write", "1", "S-0-0001", value) == ""
        assert show(bus, "soe", "read", "1", "1")["value"] == int(value)
    table = list(range(70_000, 70_300))
    run(bus, "soe", "write", "1", "P-0-0001", ",".join(map(str, table)))
    assert show(bus, "soe", "read", "1", "P-0-0001")["value"] == table
    run(bus, "soe", "write", "1", "P-0-0001", ",".join(str(i * i) for i in range(300)))
    where = "slave 1 (akd1): SoE write of S-0-0001 of drive 0: value below its minimum"
    fails(bus, REFUSED, where, "soe", "write", "1", "1", "5")
    fails(bus, USAGE, "65536: does not fit: expected 2 bytes", "soe", "write", "1", "1", "65536")
    fails(bus, USAGE, "x: is not a value: expected 2 bytes", "soe", "write", "1", "1", "x")
    fails(bus, USAGE, "1,: is not a value: expected list of", "soe", "write", "1", "0x8001", "1,")
    fails(bus, REFUSED, "slave 1 (akd1): SoE read of S-0-0005", "soe", "read", "1", "5")
    fails(bus, REFUSED, "slave 0 (akd0): SoE read of S-0-0001", "soe", "read", "0", "1")
    fails(bus, USAGE, "S-8-0001: expected an IDN such as", "soe", "read", "1", "S-8-0001")


def test_ip_parameters_are_set_and_shown(bus: Segment) -> None:
    address = ["--mac", "02:00:00:00:00:0a", "--ip", "192.168.5.2", "--mask", "255.255.255.0"]
    more = ["--gateway", "192.168.5.1", "--dns", "192.168.5.3", "--name", "drive"]
    assert run(bus, "eoe", "ip", "1") == "none is set\n"
    assert run(bus, "eoe", "ip", "1", *address) == ""
    assert lines_of(bus, "eoe", "ip", "1") == [
        "mac      02:00:00:00:00:0a",
        "ip       192.168.5.2",
        "mask     255.255.255.0",
    ]
    assert show(bus, "eoe", "ip", "1")["gateway"] is None
    run(bus, "eoe", "ip", "1", *address, *more)
    assert show(bus, "eoe", "ip", "akd1") == {
        "slave": 1,
        "port": 0,
        "mac": "02:00:00:00:00:0a",
        "ip": "192.168.5.2",
        "mask": "255.255.255.0",
        "gateway": "192.168.5.1",
        "dns": "192.168.5.3",
        "name": "drive",
    }
    fails(bus, REFUSED, "slave 2 (el2004_2): EoE ", "eoe", "ip", "2")
    fails(bus, USAGE, "--ip: 1.2.3: is not valid", "eoe", "ip", "1", "--ip", "1.2.3")
    fails(bus, USAGE, "--mac: 2: is not valid", "eoe", "ip", "1", "--mac", "2")
    fails(bus, USAGE, "--name: ", "eoe", "ip", "1", "--name", "n" * 33)


def test_an_object_is_read_and_written_by_ads(bus: Segment) -> None:
    port = ["--port", "1000"]
    assert run(bus, "aoe", "read", "1", "0x1018:1", *port) == "0x0000006a 106\n"
    assert show(bus, "aoe", "read", "1", "0x1018:1", *port, "--net-id", "1.2.3.4.5.6") == {
        "slave": 1,
        "port": 1000,
        "index": 0x1018,
        "subindex": 1,
        "bytes": "6a 00 00 00",
        "value": 106,
    }
    for value in ("513", "0"):
        run(bus, "aoe", "write", "1", "0x2050", value, *port, "--type", "DINT")
        assert run(bus, "aoe", "read", "1", "0x2050", *port, "-t", "DINT") == f"{value}\n"
    fails(bus, REFUSED, "slave 1 (akd1): AoE read", "aoe", "read", "1", "0x9999", *port)
    fails(bus, REFUSED, "slave 0 (akd0): AoE read", "aoe", "read", "0", "0x1018:1", *port)
    fails(bus, USAGE, "--port is missing", "aoe", "read", "1", "0x1018:1")
    fails(bus, USAGE, "--net-id: 1.2: expected", "aoe", "read", "1", "1:1", *port, "--net-id=1.2")


def test_bytes_of_a_vendors_protocol_go_there_and_back(bus: Segment) -> None:
    assert run(bus, "voe", "1", "0102ff", "--type", "3") == "01 02 ff\n"
    assert show(bus, "voe", "1", "01 02 FF", "-t", "0x1234") == {
        "slave": 1,
        "vendor": 0x6A,
        "type": 0x1234,
        "bytes": "01 02 ff",
    }
    assert show(bus, "voe", "1", "01", "--vendor", "0xabc")["vendor"] == 0xABC
    assert run(bus, "voe", "1", "0102", "--no-answer") == ""
    fails(bus, REFUSED, "slave 0 (akd0): VoE of vendor 0x0000006a", "voe", "0", "01")
    fails(bus, USAGE, "012: expected bytes in hex", "voe", "1", "012")
    fails(bus, USAGE, "0g: expected bytes in hex", "voe", "1", "0g")


def each_protocol_works(bus: Segment, value: str) -> None:
    run(bus, "soe", "write", "1", "1", value)
    assert show(bus, "soe", "read", "1", "1")["value"] == int(value)
    run(bus, "eoe", "ip", "1", "--name", f"n{value}")
    assert show(bus, "eoe", "ip", "1")["name"] == f"n{value}"
    assert run(bus, "aoe", "read", "1", "0x1018:1", "--port", "1") == "0x0000006a 106\n"
    assert run(bus, "voe", "1", value) == f"{value[:2]} {value[2:]}\n"
    assert run(bus, "sdo", "read", "3", "0x1018", "--complete").startswith("04 00 02")
    assert lines_of(bus, "sdo", "list", "3")[0] == "0x1000 variable"


# The last one: it leads the bus to other states.
def test_each_works_in_op_beside_the_cycle_and_in_preop_and_safeop(bus: Segment) -> None:
    undisturbed = Undisturbed(bus)
    each_protocol_works(bus, "1001")
    assert bus.status()["cycles"] > undisturbed.before["cycles"]
    undisturbed.check()
    for state, value in (("PREOP", "1002"), ("SAFEOP", "1003")):
        run(bus, "state", state)
        assert bus.status()["state"] == state
        each_protocol_works(bus, value)
