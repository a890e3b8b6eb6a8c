# SPDX-License-Identifier: MIT
"""U-Boot's script, its environments and Linux' side of the boot state agree. What the script does
is shown in QEMU: tests/boot/test_15_boot_state.py."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import wks
from conftest import TOP
from kconfig import read

sys.path.insert(0, str(TOP / "tests" / "boot"))
import boot_state

FOLDER = TOP / "recipes/recipes-bsp/u-boot-ecdaq/files"
CONFIG = TOP / "recipes/recipes-core/ecdaq-config/files/root"
SCRIPT = (FOLDER / "boot.cmd").read_text()
BOARDS = sorted(p.stem for p in FOLDER.glob("*.env"))
# What U-Boot sets itself.
BUILT_IN = {"filesize", "fdtcontroladdr", "fdtfile"}
# The configuration that each command of the script needs, if it is not always there.
COMMANDS = {
    "read": "CMD_READ",
    "write": "CMD_WRITE",
    "load": "CMD_FS_GENERIC",
    "part": "CMD_PART",
    "itest": "CMD_ITEST",
    "setexpr": "CMD_SETEXPR",
    "source": "CMD_SOURCE",
    "booti": "CMD_BOOTI",
    "mw": "CMD_MEMORY",
    "wdt": "CMD_WDT",
    "pci": "CMD_PCI",
    "usb": "CMD_USB",
    "nvme": "CMD_NVME",
}
WORDS = {
    *("if", "then", "elif", "else", "fi", "for", "do", "done", "test", "echo", "setenv", "env"),
    *("run", "reset", "sleep"),
}


def environment(board: str) -> dict[str, str]:
    """Names and values of a board's built-in environment: indented lines continue a value."""
    text = re.sub(r"/\*.*?\*/", "", (FOLDER / f"{board}.env").read_text(), flags=re.DOTALL)
    joined = re.sub(r"\n[ \t]+", " ", text)
    return dict(line.split("=", 1) for line in joined.splitlines() if "=" in line)


def commented(text: str) -> str:
    return re.sub(r"^\s*#.*$", "", text, flags=re.MULTILINE)


def set_in_script() -> dict[str, str]:
    """What the script sets to something in quotes or to words."""
    found = re.findall(r"setenv (\w+) ('[^']*'|[^\n;]*)", commented(SCRIPT))
    return {name: value.strip("'") for name, value in found}


def commands(text: str) -> set[str]:
    """The first word of each command."""
    text = re.sub(r"'([^']*)'", lambda m: f"\n{m[1]}\n", re.sub(r'"[^"]*"', "X", commented(text)))
    parts = re.split(r"[;\n]|&&|\|\|", text)
    found = set()
    for part in parts:
        words = part.split()
        while words and words[0] in ("if", "then", "elif", "else", "do"):
            found.add(words.pop(0))
        if words and re.fullmatch(r"[a-z]+(\.[bwlq])?", words[0]):
            found.add(words[0].partition(".")[0])
    return found


def configuration(board: str) -> dict[str, str]:
    merged = {}
    for name in ("common", board):
        merged |= {k: value for k, (value, _) in read(FOLDER / f"{name}.cfg").items()}
    return merged


@pytest.mark.parametrize("board", BOARDS)
def test_script_and_commands_in_variables_are_well_formed(board: str) -> None:
    texts = [SCRIPT, *set_in_script().values(), *environment(board).values()]
    for text in texts:
        # U-Boot's shell reads a subset of what this one reads.
        done = subprocess.run(["sh", "-n"], input=text, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (text, done.stderr)


@pytest.mark.parametrize("board", BOARDS)
def test_every_variable_that_is_used_is_set(board: str) -> None:
    texts = environment(board)
    everything = SCRIPT + "\n".join(texts.values())
    used = set(re.findall(r"\$\{(\w+)\}", commented(everything)))
    used |= set(re.findall(r"\brun (\w+)", commented(everything)))
    written = set(re.findall(r"(?:setenv|setexpr(?:\.b)?|for|part uuid \S+ \S+) (\w+)", everything))
    written |= {"uuid", "append", "cmdline", *set_in_script(), *BUILT_IN, *texts}
    assert used - written == set()


@pytest.mark.parametrize("board", BOARDS)
def test_every_command_that_is_used_is_configured(board: str) -> None:
    values = [v for v in environment(board).values() if not re.fullmatch("(0x)?[0-9a-f]+", v)]
    text = SCRIPT + "\n" + "\n".join(f"'{value}'" for value in values)
    config = configuration(board)
    for command in commands(text) - WORDS:
        assert config.get(f"CONFIG_{COMMANDS[command]}") == "y", command


@pytest.mark.parametrize("board", BOARDS)
def test_two_fragments_do_not_differ(board: str) -> None:
    common, own = (read(FOLDER / f"{name}.cfg") for name in ("common", board))
    assert set(common) & set(own) == set()


def test_what_is_loaded_does_not_overlap() -> None:
    for board in BOARDS:
        places = environment(board)
        addresses = {n: int(v, 16) for n, v in places.items() if "addr" in n and v[0] == "0"}
        order = sorted((at, name) for name, at in addresses.items())
        size = int(set_in_script()["state_bytes"], 16)
        gaps = {name: after - at for (at, name), (after, _) in itertools.pairwise(order)}
        assert gaps["state_addr"] >= size, board
        assert gaps["kernel_addr_r"] >= 32 << 20, board
        assert gaps["scratch_addr"] >= 64 << 10, board


def test_linux_and_the_boot_script_have_the_state_at_the_same_places() -> None:
    values = set_in_script()
    offsets = [int(values[f"state_at_{n}"], 16) * 512 for n in (0, 1)]
    size = int(values["state_bytes"], 16)
    assert [(offset, size) for offset in offsets] == boot_state.PLACES
    assert int(values["state_blocks"], 16) * 512 == size
    assert configuration("common")["CONFIG_ENV_SIZE"] == f"0x{size:x}"
    assert configuration("common")["CONFIG_SYS_REDUNDAND_ENVIRONMENT"] == "y"


def test_the_state_is_in_front_of_the_first_partition() -> None:
    end = max(offset + size for offset, size in boot_state.PLACES)
    for path in (TOP / "layers/meta-ecdaq/wic").glob("*.wks"):
        first = next(x for x in path.read_text().splitlines() if x.startswith("part "))
        (align,) = re.findall(r"--align (\d+)", first)
        assert int(align) * 1024 >= end, path
        # U-Boot knows the slots by their number.
        labels = [p.label for p in wks.parse(path).partitions]
        assert labels[:3] == ["boot", "rootA", "rootB"]


def run_boot_good(tmp_path: Path, words: str, left: str) -> list[str]:
    """The calls of fw_setenv by boot-good, of a state with `left` tries."""
    (tmp_path / "cmdline").write_text(words + "\n")
    for name, text in (
        ("fw_printenv", f"echo {left}"),
        ("fw_setenv", f'echo "$*" >> {tmp_path}/calls'),
    ):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    subprocess.run(
        [CONFIG / "usr/lib/ecdaq/boot-good"],
        env=os.environ
        | {
            "ECDAQ_CMDLINE": str(tmp_path / "cmdline"),
            "PATH": f"{tmp_path}:{os.environ['PATH']}",
        },
        check=True,
    )
    calls = tmp_path / "calls"
    return calls.read_text().splitlines() if calls.exists() else []


def test_a_good_start_writes_the_tries_of_its_own_slot(tmp_path: Path) -> None:
    tries = set_in_script()["tries"]
    assert run_boot_good(tmp_path, "ro rauc.slot=B quiet", "1") == [f"BOOT_B_LEFT {tries}"]


@pytest.mark.parametrize(
    ("words", "left"),
    [("ro quiet", "1"), ("ro rauc.slot=C", "1"), ("ro rauc.slot=A", "3")],
    ids=["no slot", "unknown slot", "nothing to write"],
)
def test_a_good_start_writes_nothing_without_need(tmp_path: Path, words: str, left: str) -> None:
    assert run_boot_good(tmp_path, words, left) == []
