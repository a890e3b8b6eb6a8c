#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Read the EEPROM image and the ESI file of fb1111-piccolo-description and compare them.

Usage: description.py PROGRAM. Both readers are written from ETG.2010 and ETG.2000 and share nothing
with the C code that wrote the files.
"""

import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

TYPES = {0x00: None, 0x01: "BOOL", 0x05: "USINT", 0x06: "UINT", 0x07: "UDINT", 0x1B: "ULINT"}
FMMUS = {1: "Outputs", 2: "Inputs", 3: "MBoxState"}
SMS = {1: "MBoxOut", 2: "MBoxIn", 3: "Outputs", 4: "Inputs"}


def number(text: str) -> int:
    return int(text[2:], 16) if text.startswith("#x") else int(text)


def crc8(data: bytes) -> int:
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc


def categories(image: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    at = 0x80
    while True:
        kind, words = struct.unpack_from("<HH", image, at)
        if kind == 0xFFFF:
            return found
        assert kind not in found, f"category {kind} twice"
        body = image[at + 4 : at + 4 + 2 * words]
        assert len(body) == 2 * words, f"category {kind} runs past the end"
        found[kind] = body
        at += 4 + 2 * words


def strings(body: bytes) -> list[str]:
    texts, at = [""], 1
    for _ in range(body[0]):
        texts.append(body[at + 1 : at + 1 + body[at]].decode("ascii"))
        at += 1 + body[at]
    assert at in (len(body), len(body) - 1)
    return texts


def sii_pdo(body: bytes, text: list[str]) -> dict:
    index, count, sm, sync, name, flags = struct.unpack_from("<HBBBBH", body)
    assert sync == 0 and flags == 0x0011 and len(body) == 8 + 8 * count
    entries = []
    for i in range(count):
        idx, sub, entry, kind, bits, _ = struct.unpack_from("<HBBBBH", body, 8 + 8 * i)
        entries.append((idx, sub, bits, text[entry], TYPES[kind]))
    return {"index": index, "sm": sm, "name": text[name], "entries": entries}


def read_sii(image: bytes) -> dict:
    cat = categories(image)
    text = strings(cat[10])
    general = cat[30]
    assert image[14] == crc8(image[:14]) and image[15] == 0
    assert len(image) == (struct.unpack_from("<H", image, 0x7C)[0] + 1) * 128
    vendor, product, revision, _ = struct.unpack_from("<IIII", image, 0x10)
    mailbox = struct.unpack_from("<HHHH", image, 0x30)
    protocols = struct.unpack_from("<H", image, 0x38)[0]
    sms = []
    for start, length, control, _, enable, kind in struct.iter_unpack("<HHBBBB", cat[41]):
        sms.append((SMS[kind], start, length, control, enable))
    modes = []
    for _, _, _, _, activate, factor, name, desc, _ in struct.iter_unpack("<IIIhHhBBI", cat[60]):
        modes.append((text[name], text[desc], activate, factor))
    return {
        "identity": (vendor, product, revision),
        "group": text[general[0]],
        "type": text[general[2]],
        "name": text[general[3]],
        "physics": "".join({1: "Y", 3: "K"}[n] for n in (general[16] & 15, general[16] >> 4) if n),
        "coe": {
            "SdoInfo": general[5] >> 1 & 1,
            "PdoAssign": general[5] >> 2 & 1,
            "PdoConfig": general[5] >> 3 & 1,
            "CompleteAccess": general[5] >> 5 & 1,
        },
        "has_coe": bool(protocols & 4) and bool(general[5] & 1),
        "mailbox": mailbox,
        "fmmu": [FMMUS[b] for b in cat[40] if b not in (0, 0xFF)],
        "sm": sms,
        "rx": sii_pdo(cat[51], text),
        "tx": sii_pdo(cat[50], text),
        "dc": modes,
        "config": image[:14],
        "bytes": len(image),
    }


def esi_pdo(element: ET.Element) -> dict:
    assert element.get("Fixed") == "1" and element.get("Mandatory") == "1"
    entries = []
    for e in element.findall("Entry"):
        entries.append(
            (
                number(e.findtext("Index")),
                number(e.findtext("SubIndex", "0")),
                int(e.findtext("BitLen")),
                e.findtext("Name", ""),
                e.findtext("DataType"),
            )
        )
    return {
        "index": number(element.findtext("Index")),
        "sm": int(element.get("Sm")),
        "name": element.findtext("Name"),
        "entries": entries,
    }


def read_esi(path: Path) -> dict:
    root = ET.parse(path).getroot()
    (device,) = root.findall("Descriptions/Devices/Device")
    kind = device.find("Type")
    sms = [
        (
            s.text,
            number(s.get("StartAddress")),
            int(s.get("DefaultSize")),
            number(s.get("ControlByte")),
            int(s.get("Enable")),
        )
        for s in device.findall("Sm")
    ]
    by_name = {s[0]: s for s in sms}
    coe = device.find("Mailbox/CoE")
    modes = []
    for mode in device.findall("Dc/OpMode"):
        cycle = mode.find("CycleTimeSync0")
        modes.append(
            (
                mode.findtext("Name"),
                mode.findtext("Desc"),
                number(mode.findtext("AssignActivate")),
                0 if cycle is None else int(cycle.get("Factor")),
            )
        )
    return {
        "identity": (
            number(root.findtext("Vendor/Id")),
            number(kind.get("ProductCode")),
            number(kind.get("RevisionNo")),
        ),
        "group": device.findtext("GroupType"),
        "type": kind.text,
        "name": device.findtext("Name"),
        "physics": device.get("Physics"),
        "coe": {
            k: int(coe.get(k)) for k in ("SdoInfo", "PdoAssign", "PdoConfig", "CompleteAccess")
        },
        "has_coe": coe is not None,
        "mailbox": by_name["MBoxOut"][1:3] + by_name["MBoxIn"][1:3],
        "fmmu": [f.text for f in device.findall("Fmmu")],
        "sm": sms,
        "rx": esi_pdo(device.find("RxPdo")),
        "tx": esi_pdo(device.find("TxPdo")),
        "dc": modes,
        "config": bytes.fromhex(device.findtext("Eeprom/ConfigData")),
        "bytes": int(device.findtext("Eeprom/ByteSize")),
    }


def check_facts(device: dict) -> None:
    """What is known of the board and of its process data, not taken from the program."""
    assert device["identity"] == (0x00000002, 0x04570862, 0x0258008D)
    assert [s[1:4] for s in device["sm"]] == [
        (0x1000, 128, 0x26),
        (0x1080, 128, 0x22),
        (0x1100, 9, 0x64),
        (0x1180, 13, 0x20),
    ]
    assert device["bytes"] == 2048
    assert device["config"][:3] == bytes.fromhex("050e03")
    assert struct.unpack_from("<H", device["config"], 4)[0] * 10 == 50000  # ns
    assert [(e[0], e[1], e[2], e[3], e[4]) for e in device["tx"]["entries"]] == [
        (0x6000, 1, 16, "adc", "UINT"),
        (0x6000, 2, 16, "counter", "UINT"),
        (0x6000, 3, 64, "sample_time", "ULINT"),
        (0x6000, 4, 8, "status", "USINT"),
    ]
    assert [(e[0], e[1], e[2], e[3], e[4]) for e in device["rx"]["entries"]] == [
        (0x7000, 1, 1, "led", "BOOL"),
        (0, 0, 7, "", None),
        (0x7000, 2, 64, "oneshot_time", "ULINT"),
    ]
    assert sum(e[2] for e in device["tx"]["entries"]) == 8 * 13
    assert sum(e[2] for e in device["rx"]["entries"]) == 8 * 9


def check_dictionary(path: Path) -> None:
    """Every object has a type that exists, of its size, and a default for each of its entries."""
    dictionary = ET.parse(path).getroot().find("Descriptions/Devices/Device/Profile/Dictionary")
    types = {t.findtext("Name"): t for t in dictionary.findall("DataTypes/DataType")}
    objects = dictionary.findall("Objects/Object")
    assert len({o.findtext("Index") for o in objects}) == len(objects) > 10
    for obj in objects:
        where = obj.findtext("Index")
        kind = types[obj.findtext("Type")]
        assert kind.findtext("BitSize") == obj.findtext("BitSize"), where
        items, defaults = kind.findall("SubItem"), obj.findall("Info/SubItem")
        assert [i.findtext("Name") for i in items] == [d.findtext("Name") for d in defaults], where
        end = 0
        for item in items:
            assert item.findtext("BitSize") == types[item.findtext("Type")].findtext("BitSize"), (
                where
            )
            assert int(item.findtext("BitOffs")) >= end, where
            end = int(item.findtext("BitOffs")) + int(item.findtext("BitSize"))
        assert not items or end == int(kind.findtext("BitSize")), where


def main() -> int:
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        sii, esi = Path(folder) / "a.bin", Path(folder) / "a.xml"
        subprocess.run([program, "--sii", sii, "--esi", esi], check=True)
        from_sii, from_esi = read_sii(sii.read_bytes()), read_esi(esi)
        for key in from_sii:
            assert from_sii[key] == from_esi[key], (
                f"{key}: SII {from_sii[key]}, ESI {from_esi[key]}"
            )
        assert from_sii.keys() == from_esi.keys()
        check_facts(from_sii)
        check_dictionary(esi)
        stdout = subprocess.run([program, "--sii", "-"], check=True, capture_output=True).stdout
        assert stdout == sii.read_bytes()
    for arguments, code in (
        [[], 2],
        [["--sii"], 2],
        [["--what", "x"], 2],
        [["--sii", "/nonexistent/x"], 1],
        [["--esi", "/dev/full"], 1],
    ):
        run = subprocess.run([program, *arguments], capture_output=True, text=True)
        assert run.returncode == code, (arguments, run)
        assert run.stderr.count("\n") == 1 and not run.stdout, (arguments, run)
    return 0


if __name__ == "__main__":
    sys.exit(main())
