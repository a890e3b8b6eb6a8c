# SPDX-License-Identifier: MIT
"""The commands of the page "From ethercat to ecdaq", in its order, on a simulated bus."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from segment import BIN, ROOT, Segment
from test_mailbox_verbs import make_drive

PAGE = ROOT / "app/doc/how-to/from-ethercat.md"
# Verbs of ethercat with the unofficial patch sets.
VERBS = [
    "alias",
    "config",
    "crc",
    "cstruct",
    "data",
    "debug",
    "diag",
    "domains",
    "download",
    "eoe",
    "eoe_addif",
    "eoe_delif",
    "foe_read",
    "foe_write",
    "graph",
    "ip",
    "master",
    "pcap",
    "pdos",
    "reboot",
    "reg_read",
    "reg_rdwr",
    "reg_write",
    "rescan",
    "sdos",
    "sii_read",
    "sii_write",
    "slaves",
    "soe_read",
    "soe_write",
    "states",
    "upload",
    "version",
    "xml",
]


def rows() -> list[tuple[list[str], str]]:
    """Of each row the verbs of ethercat, and the command in the second column."""
    found = []
    for line in PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 3 and cells[1].startswith("`ecdaq "):
            verbs = [text.split()[0] for text in re.findall(r"`([^`]+)`", cells[0])]
            found.append((verbs, cells[1].strip("`")))
    return found


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Segment]:
    sii = make_drive(tmp_path_factory.mktemp("sii"))
    segment = Segment(tmp_path_factory.mktemp("page"), slaves="akd,every,el3104")
    try:
        segment.start_sim("--sii", str(sii))
        segment.start_daemon()
        segment.wait_for_op()
        yield segment
    finally:
        segment.close()


def test_the_page_has_every_verb_of_ethercat() -> None:
    assert len(VERBS) == 34
    assert {verb for verbs, _ in rows() for verb in verbs} == set(VERBS)


def test_every_command_of_the_page_works(bus: Segment, tmp_path: Path) -> None:
    (tmp_path / "drive.cfg").write_bytes(bytes(range(256)))
    failed = []
    for _, command in rows():
        words = shlex.split(command)
        assert words[0] == "ecdaq"
        got = bus.space.run(
            *["env", "-C", str(tmp_path), f"ECDAQ_RUN_DIR={bus.run_dir}"],
            *[str(BIN / "ecdaq"), *words[1:]],
            check=False,
        )
        if got.returncode != 0 or got.stderr:
            failed.append((command, got.returncode, got.stderr))
    assert not failed
    assert (tmp_path / "back.cfg").read_bytes() == bytes(range(256))
    assert (tmp_path / "bus.pcapng").stat().st_size > 0
    assert bus.wait_for_op()["slaves"] == 3


@pytest.mark.parametrize("text", ["0x6000:11", "6000:11", "0x6000:0x11"])
def test_index_and_subindex_are_hexadecimal_as_they_are_listed(bus: Segment, text: str) -> None:
    read = json.loads(bus.ecdaq("sdo", "read", "2", text, "--json").stdout)
    assert (read["index"], read["subindex"]) == (0x6000, 0x11)
    assert len(read["bytes"].split()) == 2


def test_every_command_of_the_page_for_twincat_is_one_of_ecdaq() -> None:
    help_text = subprocess.run(
        [str(BIN / "ecdaq"), "--help"], capture_output=True, text=True, check=True
    ).stdout
    known = set(re.findall(r"^  (\w+) ", help_text, re.MULTILINE))
    text = (ROOT / "app/doc/how-to/from-twincat.md").read_text()
    used = set(re.findall(r"`ecdaq ([a-z0-9]+)", text))
    assert used and used <= known
    options = (ROOT / "app/doc/reference/options.md").read_text()
    for option in re.findall(r"`((?:slaves\[\]|gateway)\.\w+(?:\[\])?)`", text):
        assert f"`{option}`" in options or f"## {option}\n" in options, option


@pytest.mark.parametrize("page", ["from-ethercat", "from-twincat"])
def test_the_page_has_every_verb_of_ecdaq(page: str) -> None:
    """But those of every program, and on the second page what has no counterpart there."""
    help_text = subprocess.run(
        [str(BIN / "ecdaq"), "--help"], capture_output=True, text=True, check=True
    ).stdout
    verbs = set(re.findall(r"^  ([a-z]\w*) ", help_text, re.MULTILINE))
    verbs -= {"completion", "manual", "help"}
    if page == "from-twincat":
        verbs -= {"version", "security", "doctor", "stop"}
    text = (ROOT / f"app/doc/how-to/{page}.md").read_text()
    named = set(re.findall(r"`(?:ecdaq )?([a-z0-9]+)[^`]*`", text))
    assert verbs - named == set()
