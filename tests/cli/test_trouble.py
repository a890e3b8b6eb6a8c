# SPDX-License-Identifier: MIT
"""ecdaq with files that it may not read, or that are damaged."""

from __future__ import annotations

import os
import random
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import ECDAQ, FAILED, NOBODY, PERMISSION, Fake, ecdaq, fails, json_of, works

READING = [
    ["status"],
    ["slaves"],
    ["channels"],
    ["watch", "piccolo0.adc", "--count", "1"],
    ["events"],
]

LIMIT_SLAVES = 512
META = 4096  # where a ring has the description of its samples


def can_become_nobody() -> bool:
    if os.geteuid() != 0 or not ECDAQ.exists():
        return False
    tried = subprocess.run(
        [ECDAQ, "version"], user=NOBODY, group=NOBODY, capture_output=True, check=False
    )
    return tried.returncode == 0


needs_nobody = pytest.mark.skipif(
    not can_become_nobody(),
    reason="needs root, and a build directory that others may enter",
)


@needs_nobody
@pytest.mark.parametrize("words", READING, ids=" ".join)
def test_what_may_not_be_read_is_named(daemon: Fake, words: list[str]) -> None:
    remedy = "be root or in its group"
    fails(daemon(*words, user=NOBODY), PERMISSION, "no permission to read", remedy)


COMMANDS = [
    ["set", "piccolo0.led=1"],
    ["clear"],
    ["stop"],
    ["oneshot", "all", "--in", "1s"],
    ["state", "PREOP"],
    ["state", "PREOP", "0"],
    ["rescan", "--force"],
    ["sdo", "read", "0", "0x1018:1"],
    ["sdo", "write", "0", "0x8000:2", "5", "--type", "UINT"],
    ["sdo", "read", "0", "0x1018:1", "--complete"],
    ["reg", "read", "0", "0x0130"],
    ["reg", "write", "0", "0x0f80", "1"],
    ["sii", "read", "0"],
    ["sii", "alias", "0", "5"],
    ["foe", "read", "0", "a.bin"],
    ["crc", "0"],
    ["domains", "0"],
]


@needs_nobody
@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_commands_need_the_group_of_the_socket(daemon: Fake, words: list[str]) -> None:
    # Everyone may read here, so that it is the socket that rejects.
    for name in ("status", "samples", "events"):
        (daemon.run_dir / name).chmod(0o644)
    fails(
        daemon(*words, user=NOBODY),
        PERMISSION,
        f"no permission to use the admin socket {daemon.run_dir}/admin: be root or in its group",
    )


@needs_nobody
@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_member_of_the_group_may_command(daemon: Fake, words: list[str]) -> None:
    group = 4711
    for path in daemon.run_dir.iterdir():
        os.chown(path, -1, group)
        path.chmod(0o660 if path.name == "admin" else 0o640)
    works(daemon(*words, user=NOBODY, groups=[group]))


@pytest.mark.parametrize("name", ["status", "samples", "events"])
@pytest.mark.parametrize("content", ["", "x", "random", "short"])
def test_a_damaged_file_is_refused(daemon: Fake, name: str, content: str) -> None:
    path = daemon.run_dir / name
    whole = path.read_bytes()
    daemon.kill()
    path.unlink()
    path.write_bytes(
        {
            "": b"",
            "x": b"x",
            "random": random.Random(1).randbytes(len(whole)),
            "short": whole[: len(whole) // 2],
        }[content]
    )
    words = {"status": ["status"], "samples": ["channels"], "events": ["events"]}[name]
    fails(daemon(*words), FAILED, f"{path} is of another version of ecdaq, or damaged")


@pytest.mark.parametrize("words", [["channels"], ["watch", "piccolo0.adc"], ["set", "led=1"]])
def test_a_ring_of_an_older_ecdaqd_is_named_by_its_version(daemon: Fake, words: list[str]) -> None:
    path = daemon.run_dir / "samples"
    daemon.kill()
    with path.open("r+b") as file:
        file.seek(META)
        file.write((1).to_bytes(4, "little"))
    fails(
        daemon(*words),
        FAILED,
        f"{path}: ring version 1, this program reads version ",
        ": restart ecdaqd of the same release",
    )


def test_a_ring_with_a_wrong_description_never_crashes_the_reader(daemon: Fake) -> None:
    """Every byte of the header's and the meta area's first part, turned over one by one."""
    path = daemon.run_dir / "samples"
    daemon.end()
    whole = bytearray(path.read_bytes())
    dice = random.Random(2)
    places = [*range(0, 128, 3), *range(4096, 4096 + 40), *dice.sample(range(4136, 5800), 80)]
    for place in places:
        changed = bytearray(whole[: 1 << 16])
        changed[place] ^= 0xFF
        with path.open("r+b") as file:
            file.write(changed)
        result = daemon("channels", "--json")
        assert result.returncode in (0, FAILED), (place, result.stderr)
        if result.returncode == 0:
            json_of(result)


def test_a_status_page_that_claims_too_many_slaves_is_bounded(fake: Callable[..., Fake]) -> None:
    daemon = fake("SLAVES=4000000000")
    assert len(json_of(daemon("slaves", "--json"))) == LIMIT_SLAVES
    assert len(works(daemon("status")).splitlines()) > LIMIT_SLAVES


def test_an_event_of_an_unknown_kind_is_shown_as_such(daemon: Fake) -> None:
    path = daemon.run_dir / "events"
    daemon.end()
    whole = bytearray(path.read_bytes())
    # The first slot's event: its number is 40 bytes behind the slot's sequence.
    slot = 4096
    whole[slot + 8 + 40 : slot + 8 + 42] = b"\xff\x7f"
    path.write_bytes(whole)
    first = works(daemon("events", "--json")).splitlines()[0]
    assert '"event":"unknown"' in first and '"severity":"error"' in first
    assert "event 32767" in works(daemon("events"))


def test_a_run_directory_with_too_long_a_path_is_refused() -> None:
    fails(ecdaq(Path("/" + "x" * 300), "status"), 2, "the path is too long")
    fails(ecdaq(None, "--run-dir", "/" + "y" * 300, "status"), 2, "--run-dir: the path is too long")


def test_a_path_too_long_for_a_socket_is_reported(daemon: Fake, tmp_path: Path) -> None:
    deep = tmp_path / ("z" * 120)
    deep.mkdir()
    fails(ecdaq(deep, "clear"), FAILED, "File name too long")
