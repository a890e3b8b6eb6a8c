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
