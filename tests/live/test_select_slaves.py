# SPDX-License-Identifier: MIT
"""Every verb that takes a slave: by name, position and alias, several at once, as JSON."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import BIN, Segment, wait_for
from test_mailbox_verbs import make_drive

ALIAS_WORD, CHECKSUM_BYTE = 4, 14
NONE = "SLAVE"  # the word in a command that is replaced
# Two drives with every protocol, and two terminals with SDO information: these have no alias and
# are those behind the second drive.
LINE = "one,two,el3104,el3104"
ALIASES = (1001, 1002)
TERMINALS = 2  # the position of the first one

# In operation.
READING = [
    "slaves SLAVE",
    "topology SLAVE",
    "domains SLAVE",
    "data SLAVE",
    "crc SLAVE",
    "pdo SLAVE",
    "xml SLAVE",
    "sdo read SLAVE 0x1018:1",
    "sdo read SLAVE 0x1018:1 --type UDINT",
    "sdo list SLAVE",
    "sdo startup SLAVE",
    "soe read SLAVE S-0-0001",
    "soe list SLAVE",
    "eoe ip SLAVE",
    "aoe read SLAVE 0x1018:1 --port 1000",
    "reg read SLAVE 0x0130",
    "sii read SLAVE",
]
# Led to PRE-OP.
WRITING = [
    "sdo write SLAVE 0x2050 5 --type DINT",
    "soe write SLAVE S-0-0001 2000",
    "aoe write SLAVE 0x2050 5 --type DINT --port 1000",
    "voe SLAVE 0102",
    "reg write SLAVE 0x0300 0",
    "foe write SLAVE drive.cfg",
    "foe read SLAVE drive.cfg",
    "firmware SLAVE drive.efw",
    "sii alias SLAVE 1001",
    "state PREOP SLAVE",
]
# Of which another test shows it: armed boards.
ELSEWHERE = {"oneshot"}
WITHOUT_JSON = {"xml"}


def checksum(data: bytes) -> int:
    """CRC-8 of words 0 to 6 of an SII."""
    crc = 0xFF
    for octet in data:
        crc ^= octet
        for _ in range(8):
            crc = (crc << 1 ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    sii = make_drive(tmp_path_factory.mktemp("sii"))
    for name, alias in zip(("one", "two"), ALIASES, strict=True):
        image = bytearray((sii / "every.bin").read_bytes())
        image[2 * ALIAS_WORD : 2 * ALIAS_WORD + 2] = alias.to_bytes(2, "little")
        image[CHECKSUM_BYTE] = checksum(image[:CHECKSUM_BYTE])
        (sii / f"{name}.bin").write_bytes(image)
    segment = Segment(tmp_path_factory.mktemp("select"), slaves=LINE)
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        yield segment
    finally:
        segment.close()


def run(bus: Segment, folder: Path, *words: str) -> str:
    got = bus.space.run(
        *["env", "-C", str(folder), f"ECDAQ_RUN_DIR={bus.run_dir}", str(BIN / "ecdaq"), *words],
        check=False,
    )
    assert (got.returncode, got.stderr) == (0, ""), (words, got.stderr)
    return got.stdout


def first_of(command: str) -> int:
    return TERMINALS if command.startswith("sdo list") else 0


def forms(bus: Segment, command: str) -> list[list[str]]:
    """The command for the second one of its slaves: by name, position, alias."""
    second = first_of(command) + 1
    name = json.loads(bus.ecdaq("slaves", "--json").stdout)[second]["name"]
    words = command.split()
    without = [word for word in words if word != NONE]
    return [
        [name if word == NONE else word for word in words],
        [str(second) if word == NONE else word for word in words],
        [*without, "-p", str(second)],
        [*without, f"--position={second}"],
        [*without, "-a", str(ALIASES[1]), "-p", str(second - 1)],
    ]


def values(text: str) -> list[Any]:
    """JSON of one value or a line each; arrays of slaves opened."""
    found: list[Any] = []
    for line in text.splitlines():
        value = json.loads(line)
        found += value if isinstance(value, list) else [value]
    return found


def is_changing(command: str) -> bool:
    return command.split()[0] in {"slaves", "crc", "data", "domains", "topology"}


@pytest.mark.parametrize("command", READING)
def test_a_slave_is_meant_by_name_position_and_alias(
    bus: Segment, tmp_path: Path, command: str
) -> None:
    bus.wait_for_op()
    shown = [run(bus, tmp_path, *words) for words in forms(bus, command)]
    assert all(shown) or command.startswith("sdo startup")
    if not is_changing(command):
        assert len(set(shown)) == 1
    if command.split()[0] in WITHOUT_JSON:
        return
    by_name, *_, by_alias = forms(bus, command)
    as_json = [values(run(bus, tmp_path, *words, "--json")) for words in (by_name, by_alias)]
    assert len({len(one) for one in as_json}) == 1


@pytest.mark.parametrize("command", READING)
def test_several_slaves_are_read_at_once(bus: Segment, tmp_path: Path, command: str) -> None:
    bus.wait_for_op()
    words = [word for word in command.split() if word != NONE]
    first = first_of(command)
    pair = f"{first}-{first + 1}"
    shown = [
        run(bus, tmp_path, *words, *selection)
        for selection in (
            ["-p", pair],
            ["-p", f"{first},{first + 1}"],
            ["-a", str(ALIASES[0]), "-p", pair],
        )
    ]
    if not is_changing(command):
        assert len(set(shown)) == 1
    if words[0] not in WITHOUT_JSON | {"topology", "domains", "data"}:
        count = len(values(run(bus, tmp_path, *words, "-p", str(first), "--json")))
        assert len(values(run(bus, tmp_path, *words, "-p", pair, "--json"))) == 2 * count


def test_slaves_are_written_by_name_position_and_alias_and_several_at_once(
    bus: Segment, tmp_path: Path
) -> None:
    for name in ("drive.cfg", "drive.efw"):
        (tmp_path / name).write_bytes(bytes(range(64)))
    bus.ecdaq("state", "PREOP")
    wait_for("PREOP", lambda: bus.status().get("state") == "PREOP", 60)
    for command in WRITING:
        words = [word for word in command.split() if word != NONE]
        for form in forms(bus, command):
            if command.startswith("state") and form[-2:-1] != [] and form[-2].startswith("-"):
                continue  # its SLAVE is the second word: without it, it is for all
            run(bus, tmp_path, *form)
        run(bus, tmp_path, *forms(bus, command)[0], "--json")
        run(bus, tmp_path, *words, "-p", "0-1")


def test_no_verb_with_a_slave_is_left_out() -> None:
    def text(*words: str) -> str:
        return subprocess.run(
            [BIN / "ecdaq", *words], capture_output=True, text=True, check=True
        ).stdout

    verbs = set(re.findall(r"^  ([a-z]\w*) ", text("--help"), re.MULTILINE)) - {"log", "security"}
    with_slave = {verb for verb in verbs if "SLAVE" in text(verb, "--help").splitlines()[0]}
    assert with_slave == {command.split()[0] for command in READING + WRITING} | ELSEWHERE
