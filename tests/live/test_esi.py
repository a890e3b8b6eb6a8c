# SPDX-License-Identifier: MIT
"""ESI files for slaves that do not name themselves, and ESI files of slaves that are there."""

from __future__ import annotations

import json
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import BIN, Segment, wait_for

STRINGS, DC_MODES, VENDOR_SPECIFIC = 10, 60, 0x0800
SLAVES = "el2004,el3104,fb1111_piccolo"

ESI = """<?xml version="1.0" encoding="ISO-8859-1"?>
<EtherCATInfo><Vendor><Id>{vendor}</Id></Vendor><Descriptions><Devices><Device>
<Type ProductCode="#x{product:08x}" RevisionNo="#x{revision:08x}">EL2004</Type>
<Name LcId="1033">EL2004 4Ch. Dig. Output</Name>
{pdos}</Device></Devices></Descriptions></EtherCATInfo>
"""


def hide(image: bytes, *kinds: int) -> bytes:
    """@image with its categories @kinds renamed: the master no longer finds them."""
    changed = bytearray(image)
    at = 0x80
    while True:
        kind, words = struct.unpack_from("<HH", changed, at)
        if kind == 0xFFFF:
            return bytes(changed)
        if kind in kinds:
            struct.pack_into("<H", changed, at, VENDOR_SPECIFIC)
        at += 4 + 2 * words


def esi_of(image: bytes, pdos: list[dict[str, Any]]) -> str:
    vendor, product, revision = struct.unpack_from("<III", image, 0x10)
    texts = []
    for number, pdo in enumerate(pdos):
        kind = "TxPdo" if pdo["direction"] == "input" else "RxPdo"
        texts.append(f"<{kind}><Index>#x{pdo['index']:04x}</Index><Name>Valve {number + 1}</Name>")
        for entry in pdo["entry"]:
            texts.append(
                f"<Entry><Index>#x{entry['index']:04x}</Index><SubIndex>{entry['subindex']}"
                f"</SubIndex><BitLen>{entry['bits']}</BitLen><Name>Open</Name>"
                "<DataType>BOOL</DataType></Entry>"
            )
        texts.append(f"</{kind}>")
    return ESI.format(vendor=vendor, product=product, revision=revision, pdos="".join(texts))


COMMAND = (
    "<InitCmd><Transition>{}</Transition><Index>#x8000</Index><SubIndex>{}</SubIndex>"
    "<Data>{}</Data></InitCmd>"
)


def board_with(folder: Path, *commands: str) -> Path:
    """A folder with the ESI file of a board with these start-up commands."""
    text = ESI.format(
        vendor=2,
        product=0x04570862,
        revision=0,
        pdos=f"<Mailbox><CoE>{''.join(commands)}</CoE></Mailbox>",
    )
    (folder / "esi").mkdir()
    (folder / "esi" / "board.xml").write_text(text)
    return folder / "esi"


@pytest.mark.parametrize(
    ("sdo", "wanted"), [("[]", "25"), ("[IP 0x8000:02 UINT = 30]", "30")], ids=["esi", "replaced"]
)
def test_start_up_commands_of_an_esi_are_written_unless_the_configuration_has_others(
    tmp_path: Path, sdo: str, wanted: str
) -> None:
    folder = board_with(tmp_path, COMMAND.format("IP", 2, "1900"))
    (tmp_path / "run").mkdir()
    (tmp_path / "ecdaq.yaml").write_text(f"slaves:\n  - name: a\n    sdo: {sdo}\n")
    segment = in_preop(tmp_path / "run", "fb1111_piccolo", **{"bus.esi_dir": str(folder)})
    try:
        segment.start_sim()
        segment.start_daemon("--config", str(tmp_path / "ecdaq.yaml"))
        wait_for_preop(segment)
        got = segment.ecdaq("sdo", "read", "a", "0x8000:2", "--type", "UINT").stdout.strip()
        assert got == wanted
    finally:
        segment.close()


def test_a_start_up_command_of_an_esi_that_is_refused_is_named_as_such(tmp_path: Path) -> None:
    folder = board_with(tmp_path, COMMAND.format("PS", 1, "07"))
    (tmp_path / "run").mkdir()
    segment = Segment(
        tmp_path / "run", slaves="fb1111_piccolo", settings={"bus.esi_dir": str(folder)}
    )
    try:
        segment.start_sim()
        segment.start_waiting_daemon()
        wait_for("waiting", lambda: segment.status().get("waiting"), 120)
        assert show(segment, "state")["message"].endswith(
            ": start-up SDO 0x8000:01 at PS (InitCmd of its ESI description) rejected: abort "
            "0x06090030, value out of range"
        )
    finally:
        segment.close()


def show(bus: Segment, *words: str) -> Any:
    got = bus.ecdaq(*words, "--json", check=False)
    assert (got.returncode, got.stderr) == (0, "")
    return json.loads(got.stdout)


def in_preop(folder: Path, slaves: str, **settings: str) -> Segment:
    segment = Segment(folder, slaves=slaves, settings={"bus.target": "preop", **settings})
    return segment


def wait_for_preop(segment: Segment) -> None:
    wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 120)


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    """Three slaves in PRE-OP."""
    try:
        segment = in_preop(tmp_path_factory.mktemp("esi"), SLAVES)
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    try:
        segment.start_sim()
        segment.start_daemon()
        wait_for_preop(segment)
        yield segment
    finally:
        segment.close()


def described(path: Path) -> Any:
    got = subprocess.run(
        [BIN / "ecdaq", "esi", "--json", path], capture_output=True, text=True, timeout=60
    )
    assert (got.returncode, got.stderr) == (0, "")
    return json.loads(got.stdout)


def common(pdos: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What `pdo` and `esi` both have of PDOs that are assigned, padding without a name or type."""
    found = []
    for pdo in pdos:
        if not pdo.get("assigned", True) or pdo["sm"] is None:
            continue
        entries = [
            entry if entry["index"] else {"index": 0, "bits": entry["bits"]}
            for entry in pdo["entry"]
        ]
        keys = ("index", "name", "direction", "sm", "bits")
        found.append({key: pdo[key] for key in keys} | {"entry": entries})
    return sorted(found, key=lambda pdo: pdo["index"])


def test_the_esi_of_a_slave_is_read_back_to_its_pdos(bus: Segment, tmp_path: Path) -> None:
    bus.ecdaq("xml", "--output", str(tmp_path / "all.xml"))
    devices = described(tmp_path / "all.xml")
    slaves = show(bus, "scan")
    assert len(devices) == len(slaves) == 3
    for slave, device, pdo in zip(slaves, devices, show(bus, "pdo"), strict=True):
        for key in ("vendor", "product", "revision"):
            assert device[key] == slave[key]
        assert device["name"] == slave["device"]
        assert common(device["pdo"]) == common(pdo["pdo"]) != []


def test_one_slave_is_a_file_of_its_own(bus: Segment, tmp_path: Path) -> None:
    text = bus.ecdaq("xml", "2").stdout
    assert text.startswith('<?xml version="1.0" encoding="UTF-8"?>\n<EtherCATInfo>')
    (tmp_path / "one.xml").write_text(text)
    (device,) = described(tmp_path / "one.xml")
    assert (device["vendor"], device["product"]) == (0x2, 0x04570862)
    assert [mode["assign_activate"] for mode in device["dc_mode"]] != []


def test_a_slave_without_names_has_those_of_its_esi(bus: Segment, tmp_path: Path) -> None:
    sii, esi = tmp_path / "sii", tmp_path / "esi"
    sii.mkdir()
    esi.mkdir()
    bus.ecdaq("sii", "read", "0", "--output", str(tmp_path / "el2004.bin"))
    image = (tmp_path / "el2004.bin").read_bytes()
    (sii / "mute.bin").write_bytes(hide(image, STRINGS))
    (esi / "a bad one.xml").write_text("<EtherCATInfo>\n<Vendor></Wendor>")
    (esi / "el2004.xml").write_text(esi_of(image, show(bus, "pdo", "0")[0]["pdo"]))
    (tmp_path / "run").mkdir()
    segment = Segment(tmp_path / "run", slaves="mute", settings={"bus.esi_dir": str(esi)})
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        names = [channel["name"] for channel in show(segment, "channels")]
        assert names == [f"el2004_0.valve_{n}_open" for n in (1, 2, 3, 4)]
        (slave,) = show(segment, "pdo")
        assert [pdo["name"] for pdo in slave["pdo"]] == [f"Valve {n}" for n in (1, 2, 3, 4)]
        assert {entry["name"] for pdo in slave["pdo"] for entry in pdo["entry"]} == {"Open"}
        log = segment.log("daemon")
        assert "warning: bus.esi_dir: " in log and "a bad one.xml:2: no XML: mismatched tag" in log
    finally:
        segment.close()


def dictionary_of(pdos: list[dict[str, Any]]) -> str:
    """An object of one entry, with a name and a unit, for each that is mapped."""
    kind = "<DataType><Name>R</Name><SubItem><SubIdx>1</SubIdx><Name>Open</Name><Type>BOOL</Type>"
    objects = [
        f"<Object><Index>#x{entry['index']:04x}</Index><Name>Valve</Name><Type>R</Type><Info>"
        "<SubItem><Name>Open</Name><Info><Unit>#x00410000</Unit></Info></SubItem></Info></Object>"
        for pdo in pdos
        for entry in pdo["entry"]
    ]
    return (
        f"<Profile><Dictionary><DataTypes>{kind}</SubItem></DataType></DataTypes>"
        f"<Objects>{''.join(objects)}</Objects></Dictionary></Profile>"
    )


def test_names_types_and_units_are_those_of_the_dictionary_of_its_esi(
    bus: Segment, tmp_path: Path
) -> None:
    sii, esi = tmp_path / "sii", tmp_path / "esi"
    sii.mkdir()
    esi.mkdir()
    bus.ecdaq("sii", "read", "0", "--output", str(tmp_path / "el2004.bin"))
    image = (tmp_path / "el2004.bin").read_bytes()
    (sii / "mute.bin").write_bytes(hide(image, STRINGS))
    vendor, product, revision = struct.unpack_from("<III", image, 0x10)
    text = ESI.format(
        vendor=vendor,
        product=product,
        revision=revision,
        pdos=dictionary_of(show(bus, "pdo", "0")[0]["pdo"]),
    )
    (esi / "el2004.xml").write_text(text)
    (tmp_path / "run").mkdir()
    segment = Segment(tmp_path / "run", slaves="mute", settings={"bus.esi_dir": str(esi)})
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        channels = show(segment, "channels")
        assert [channel["unit"] for channel in channels] == ["deg"] * 4
        assert all("open" in channel["name"] for channel in channels)
        (slave,) = show(segment, "pdo")
        assert {entry["name"] for pdo in slave["pdo"] for entry in pdo["entry"]} == {"Open"}
    finally:
        segment.close()
    (device,) = described(esi / "el2004.xml")
    assert [one["unit"] for one in device["unit"]] == ["deg"] * 4
