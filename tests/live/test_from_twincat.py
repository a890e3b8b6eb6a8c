# SPDX-License-Identifier: MIT
"""Each row of the page "From TwinCAT to ecdaq" as commands on a simulated bus."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from segment import BIN, ROOT, Segment, wait_for
from test_firmware import image
from test_mailbox_verbs import make_drive

PAGE = ROOT / "app/doc/how-to/from-twincat.md"
# 0: CoE, EoE, FoE; 1: every protocol; 2: an analog terminal; 3: firmware by FoE.
SLAVES = "akd,every,el3104,fb1111_piccolo"
# By the first column; in an order in which each finds what it needs. The bus is in OP up to "Init".
ROWS = {
    "Scan devices": ["scan --write found.yaml", "config check found.yaml"],
    "Export of the configuration (ENI)": [
        "eni write -o twincat.xml",
        "eni check twincat.xml",
        "eni import twincat.xml -o imported.yaml",
    ],
    "ESI library (device descriptions)": ["xml -p 0 --output akd.xml", "esi -v akd.xml"],
    "Slots: modules of a modular device": ["sdo startup 1"],
    'Compare expected and found ("copy after")': ["config diff"],
    "Online: state and CRC of each slave": ["slaves", "crc", "crc --interval 100ms --count 2"],
    "Online: Clear CRC": ["crc --reset", "clear"],
    "Online: frame counters, lost frames": ["status", "histogram round-trip"],
    "Topology, red ports": ["topology", "topology --dot"],
    "Diagnosis history": ["events --level info"],
    "CoE - Online": [
        "sdo list 2",
        "sdo read 0 0x1018:1",
        "sdo write 1 0x2050 5 --type DINT",
    ],
    "SoE - Online": ["soe list 1", "soe read 1 S-0-0001", "soe write 1 S-0-0001 2000"],
    "FoE": ["foe write 0 drive.cfg", "foe read 0 drive.cfg -o back.cfg"],
    "EoE: IP settings": ["eoe ip 1 --ip 192.168.5.2 --mask 255.255.255.0", "eoe ip 1"],
    "AoE": ["aoe read 1 0x1018:1 --port 1000"],
    "VoE": ["voe 1 0102"],
    "Start-up": ["sdo startup 0"],
    "Process data: SyncManagers, assignment": ["pdo 0"],
    "Process data: sizes, addresses, FMMUs": ["domains"],
    "DC: mode, SYNC0, shift": ["slaves -v"],
    "Watch window, force values": ["watch '*adc' --count 1", "set piccolo3.led=1"],
    "Variables: names, units, scaling": ["channels", "data", "cstruct -o image.h"],
    "Capture with Wireshark": ["pcap -n 100 -o bus.pcapng"],
    "Online: Init, Pre-Op, Safe-Op, Op": [
        "state SAFEOP",
        "state PREOP 1",
        "state SAFEOP 1",
        "state PREOP",
        "state",
    ],
    "Advanced: ESC registers, EEPROM": ["reg read 0 0x0130", "sii show 0", "sii alias 0 1001"],
    "Online: Bootstrap, firmware update": ["firmware 3 firmware.bin"],
    "Reload devices, restart in Config or Run mode": ["rescan --force", "state OP"],
}
# Shown elsewhere: pictures and recordings, options, programs.
ELSEWHERE = {
    "Identification by alias or serial number": "tests/live/test_engineering.py",
    "Links between variables": "tests/live/test_control.py",
    "Scope": "tests/cli/test_web_scope.py",
    "Mailbox gateway": "tests/live/test_gateway.py",
    "PLC task": "tests/live/test_control.py",
}


def first_column() -> list[str]:
    lines = [line for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    return [line.split("|")[1].strip() for line in lines][2:]


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    sii = make_drive(tmp_path_factory.mktemp("sii"))
    segment = Segment(tmp_path_factory.mktemp("twincat"), slaves=SLAVES)
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        yield segment
    finally:
        segment.close()


def test_every_row_of_the_page_is_tested() -> None:
    assert set(first_column()) == set(ROWS) | set(ELSEWHERE)
    assert all((ROOT / path).is_file() for path in ELSEWHERE.values())


def test_each_row_names_the_verbs_that_are_run_for_it() -> None:
    for line in PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        for command in ROWS.get(cells[0] if cells else "", []):
            assert f"`ecdaq {command.split()[0]}" in line or command.split()[0] in (
                "config", "state",
            ), command  # fmt: skip


def test_every_row_works(bus: Segment, tmp_path: Path) -> None:
    (tmp_path / "drive.cfg").write_bytes(bytes(range(256)))
    (tmp_path / "firmware.bin").write_bytes(image("2.0"))
    failed = []
    for row, commands in ROWS.items():
        for command in commands:
            got = bus.space.run(
                *["env", "-C", str(tmp_path), f"ECDAQ_RUN_DIR={bus.run_dir}"],
                *[str(BIN / "ecdaq"), *shlex.split(command)],
                check=False,
            )
            # What an ENI file has and ecdaq does not is listed.
            is_quiet = got.stderr == "" or command.startswith("eni import")
            if got.returncode != 0 or not is_quiet:
                failed.append((row, command, got.returncode, got.stderr))
    assert not failed
    assert (tmp_path / "back.cfg").read_bytes() == bytes(range(256))
    assert "slaves:" in (tmp_path / "imported.yaml").read_text()
    wait_for("OP", lambda: bus.status().get("state") == "OP", 120)
