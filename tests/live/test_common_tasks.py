# SPDX-License-Identifier: MIT
"""The page "Seven common settings, step by step": blocks, commands, and their effect."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from bus import tell
from segment import BIN, ROOT, Segment, wait_for

PAGE = (ROOT / "app/doc/how-to/configure-common-tasks.md").read_text()
SECTIONS = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S))
SHIFT_NS = 100_000


def blocks(section: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", SECTIONS[section], re.S)


def commands(section: str) -> list[str]:
    return "".join(blocks(section, "sh")).splitlines()


def whole_file() -> dict[str, Any]:
    """All blocks together: items of slaves[] with the same name are one."""
    whole: dict[str, Any] = {}
    slaves: dict[str, dict[str, Any]] = {}
    for section in SECTIONS:
        for block in blocks(section, "yaml"):
            part = yaml.safe_load(block)
            for slave in part.pop("slaves", []):
                slaves.setdefault(slave["name"], {}).update(slave)
            whole |= part
    return whole | {"slaves": list(slaves.values())}


class User:
    """Types the commands of the page beside the file."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment

    def type(self, command: str) -> str:
        words = shlex.split(command)
        got = self.segment.space.run(
            *["env", "-C", str(self.segment.folder), f"ECDAQ_RUN_DIR={self.segment.run_dir}"],
            *[str(BIN / words[0]), *words[1:]],
            *(["--dir", str(self.segment.record_dir)] if words[1] == "log" else []),
        )
        return got.stdout

    def all_of(self, section: str) -> list[str]:
        return [self.type(command) for command in commands(section)]


@pytest.fixture
def user(make_segment: Callable[..., Segment]) -> User:
    (slaves,) = re.findall(r"run --slaves (\S+)`", PAGE)
    segment = make_segment(slaves=slaves)
    # For DDS.
    segment.space.run("ip", "link", "set", "lo", "multicast", "on", "up")
    segment.start_sim("--control", str(segment.folder / "control"))
    return User(segment)


def write_file(segment: Segment) -> Path:
    """The page's file, with this machine's ports and a rotation that a test can wait for."""
    wanted = whole_file()
    wanted["bus"]["interface"] = "ecat0"
    wanted["dds"]["interface"] = "lo"
    wanted["record"] |= {"rotate_period": "1s", "dir": str(segment.record_dir)}
    file = segment.folder / "ecdaq.yaml"
    file.write_text(yaml.safe_dump(wanted, allow_unicode=True, sort_keys=False))
    return file


def test_the_table_counts_the_lines_and_commands_of_each_task() -> None:
    table = re.findall(r"^\| \[(.*?)\]\(#.*?\) \| (\d+) \| (\d+) \|$", PAGE, re.M)
    counted = [
        (section, len("".join(blocks(section, "yaml")).splitlines()), len(commands(section)))
        for section in SECTIONS
    ]
    assert [(name, int(lines), int(typed)) for name, lines, typed in table] == counted


def check_values(user: User) -> None:
    assert "front.pressure[bar]" in user.all_of("Scale and unit of a channel")[0]
    channels = json.loads(user.type("ecdaq channels --json"))
    (pressure,) = [one for one in channels if one["name"] == "front.pressure"]
    assert (pressure["unit"], pressure["scale"], pressure["offset"]) == ("bar", 0.0025, -1)


def check_startup(user: User) -> None:
    (listed,) = user.all_of("Start-up SDOs")
    rows = [" ".join(line.split()[:-1]) for line in listed.splitlines()]
    # 1.5 as REAL, -100 as INT.
    assert [row.rpartition(" slaves[].sdo,")[0] for row in rows] == [
        "PS 0x6000:03 00 00 c0 3f",
        "SO 0x7000:01 9c ff",
    ]


def check_shift(user: User) -> None:
    verbose, times = user.all_of("Shift of SYNC0")
    assert re.search(r"SYNC0 shift +100 us", verbose)
    for line in times.splitlines()[1:]:
        front, rear = (int(word) for word in line.split()[2:4])
        assert rear - front == SHIFT_NS, line


def check_fail_safe(user: User, control: Path) -> None:
    user.all_of("An output with a fail-safe value")
    wait_for("LED off", lambda: tell(control, "io slave=0") == "led=0", 60)
    assert tell(control, "at=0s power-off slave=2") == "ok"
    wait_for("LED on", lambda: tell(control, "io slave=0") == "led=1", 60)


def test_each_setting_has_its_effect_on_the_bus(user: User) -> None:
    segment = user.segment
    for command in commands("Keys for DDS")[:-1]:
        user.type(command)
    file = write_file(segment)
    user.type(commands("Keys for DDS")[-1])
    checked = user.type(commands("Three named slaves")[0])
    assert checked == "ecdaq.yaml: valid\n"
    del segment.settings["bus.interface"], segment.settings["record.dir"]
    segment.start_daemon("--config", str(file))
    segment.start("recorder", str(BIN / "ecdaq-record"), *segment.options(), "--config", str(file))
    segment.wait_for_op()
    named = user.type(commands("Three named slaves")[1])
    assert [line.split()[4] for line in named.splitlines()] == ["front", "rear", "gauge"]
    check_values(user)
    check_startup(user)
    check_shift(user)
    (listing,) = commands("How long recordings are kept")
    wait_for("second file", lambda: user.type(listing).count(".mcap") >= 2, 60)
    check_fail_safe(user, segment.folder / "control")
