# SPDX-License-Identifier: MIT
"""What tests/boot finds on a disk that a cut in an update has left: slot, boot state, own files.
The logs are made here."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from conftest import TOP
from test_write_log import FLUSH, Op, write_log

sys.path.append(str(TOP / "tests" / "boot"))
import boot_state
import cut_updates
from boot_state import Copy, slots
from cut_disks import Cut, Found
from cut_updates import DATA, SLOT, STATE, STATE_FIRST, STATE_SECTORS, Replay, Update
from write_log import SECTOR, Fate, WriteLog

SLOT_FIRST, SLOT_SECTORS = STATE_FIRST + STATE_SECTORS, 4
DATA_FIRST, DATA_SECTORS = SLOT_FIRST + SLOT_SECTORS, 4
NEW = b"n" * SLOT_SECTORS * SECTOR
A_NEXT, B_NEXT = slots("A B", 3, 0), slots("B A", 3, 3)
OWN = {"system/own": "mine\n"}
Make = Callable[..., Replay]


def state(place: int, counter: int, values: dict[str, str]) -> Op:
    return Op(boot_state.PLACES[place][0] // SECTOR, Copy(counter, values).pack())


# Slot, flush, boot state, flush; then something small.
GOOD = (
    Op(DATA_FIRST, b"d" * SECTOR),
    Op(SLOT_FIRST, NEW),
    FLUSH,
    state(1, 2, B_NEXT),
    FLUSH,
    Op(DATA_FIRST, b"e" * SECTOR),
)


@dataclass
class Disks:
    """Stands for the file system of the data partition."""

    texts: dict[str, str]
    found: Found

    def debugfs(self, *command: str | Path) -> object:
        name = str(command[2]).removeprefix("cat ")
        return type("Done", (), {"stdout": self.texts.get(name, "")})


@pytest.fixture
def disks(monkeypatch: pytest.MonkeyPatch) -> Disks:
    fake = Disks(dict(OWN), Found(cycles={1: {1, 2}}))
    monkeypatch.setattr(cut_updates, "run", fake.debugfs)
    monkeypatch.setattr(cut_updates, "look_at", lambda _: replace(fake.found, problems=[]))
    return fake


@pytest.fixture
def make(tmp_path: Path, disks: Disks) -> Make:
    def replay(*ops: Op, done: int = 0) -> Replay:
        """`done`: number of the entry before which the update was acknowledged; 0: never."""
        base = tmp_path / "base"
        base.write_bytes(bytes((DATA_FIRST + DATA_SECTORS) * SECTOR))
        boot_state.write(base, [Copy(1, A_NEXT).pack(), bytes(boot_state.PLACES[0][1])])
        (tmp_path / "image").write_bytes(NEW)
        log = write_log(tmp_path / "log", list(ops))
        end = WriteLog(log).ends[done - 1] if done else 1 << 40
        parts = {
            STATE: (STATE_FIRST, STATE_SECTORS),
            SLOT: (SLOT_FIRST, SLOT_SECTORS),
            DATA: (DATA_FIRST, DATA_SECTORS),
        }
        update = Update("made", log, base, parts, tmp_path / "image", 0, end, OWN)
        work = tmp_path / "work"
        work.mkdir()
        found = Replay(update, work)
        found.look_before(0)
        return found

    return replay


def problems(made: Replay, count: int, fate: Fate) -> tuple[str, ...]:
    return made.look(Cut(1, count, fate), 1).problems


@pytest.mark.parametrize("fate", list(Fate))
def test_an_update_in_the_right_order_survives_every_cut(make: Make, fate: Fate) -> None:
    made = make(*GOOD)
    slots_seen = [made.look(Cut(n, n, fate), n) for n in range(1, len(GOOD) + 1)]
    assert [r.problems for r in slots_seen] == [()] * len(GOOD)
    assert slots_seen[0].slot == "A" and slots_seen[-1].slot == "B"


def test_a_slot_that_is_named_before_it_is_written_is_found(make: Make) -> None:
    made = make(Op(SLOT_FIRST, NEW), state(1, 2, B_NEXT), FLUSH)
    assert problems(made, 2, Fate.KEPT) == ()
    made.parts[STATE].settle()
    assert problems(made, 2, Fate.DROPPED) == ("slot B starts next and is not whole",)


def test_a_boot_state_without_a_whole_copy_is_found(make: Make) -> None:
    torn = Op(boot_state.PLACES[0][0] // SECTOR, b"x" * SECTOR)
    made = make(torn, FLUSH)
    assert problems(made, 2, Fate.KEPT) == ("no copy of the boot state is whole",)


def test_a_boot_state_without_a_try_left_is_found(make: Make) -> None:
    made = make(state(1, 2, slots("A B", 0, 0)), FLUSH)
    assert problems(made, 2, Fate.KEPT) == ("no slot has a try left",)


def test_an_update_that_was_acknowledged_and_is_not_there_is_found(make: Make) -> None:
    made = make(*GOOD[:4], Op(DATA_FIRST, b"e" * SECTOR), done=4)
    wanted = "slot A starts next, and the update was acknowledged"
    assert problems(made, 4, Fate.DROPPED) == (wanted,)
    assert problems(made, 4, Fate.KEPT) == ()


def test_own_files_and_recordings_that_are_lost_are_found(make: Make, disks: Disks) -> None:
    made = make(*GOOD)
    disks.texts["system/own"] = ""
    disks.found.cycles = {1: {1}}
    assert problems(made, 1, Fate.KEPT) == (
        "system/own is '', not 'mine\\n'",
        "1 recorded cycles are lost",
    )


def test_what_is_written_elsewhere_is_found(make: Make) -> None:
    made = make(*GOOD, Op(1, b"z" * SECTOR))
    assert [e.sector for e in cut_updates.elsewhere(made.update)] == [1]
    shorter = write_log(made.update.log.with_name("shorter"), list(GOOD))
    assert cut_updates.elsewhere(replace(made.update, log=shorter)) == []


def test_each_part_and_fate_is_cut_as_often_and_in_order(make: Make) -> None:
    made = make(*GOOD)
    cuts = cut_updates.make_cuts(made.update, 24, 1)
    assert [c.count for c in cuts] == sorted(c.count for c in cuts)
    assert all(sum(c.fate is fate for c in cuts) == 6 for fate in Fate)
    assert cuts == cut_updates.make_cuts(made.update, 24, 1)
    assert min(c.count for c in cuts) >= 1 and max(c.count for c in cuts) == len(GOOD)


@pytest.mark.parametrize(
    ("copies", "slot"),
    [
        ((None, None), "A"),
        ((Copy(1, B_NEXT), None), "B"),
        ((Copy(255, A_NEXT), Copy(0, B_NEXT)), "B"),
        ((Copy(0, A_NEXT), Copy(255, B_NEXT)), "A"),
        ((Copy(3, slots("B A", 2, 0)), Copy(2, B_NEXT)), "A"),
        ((Copy(3, slots("A B", 0, 0)), None), None),
    ],
)
def test_the_slot_that_starts_next(
    copies: tuple[Copy | None, Copy | None], slot: str | None
) -> None:
    """The same rule is compared with U-Boot itself in tests/boot/test_15_boot_state.py."""
    assert boot_state.next_slot(copies) == slot
