# SPDX-License-Identifier: MIT
"""A bus that refuses OP for five reasons: the commands of the page lead to each, and out of it."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

from bus import tell
from segment import BIN, ROOT, NeverError, Segment, wait_for

# These measure time, or need a cycle in time.
IDLE = True
PAGE = ROOT / "app/doc/how-to/fix-a-bus-that-does-not-reach-op.md"
REFUSED = 17
DIFFERS = 9


def blocks(title: str) -> list[list[str]]:
    """The commands of each sh block of the section @title."""
    section = PAGE.read_text().split(f"\n## {title}\n")[1].split("\n## ")[0]
    return [block.splitlines() for block in re.findall(r"```sh\n(.*?)```", section, re.DOTALL)]


def run(segment: Segment, command: str) -> subprocess.CompletedProcess[str]:
    """Repeated while ecdaqd tries a bring-up by itself."""
    words = shlex.split(command)
    assert words[0] == "ecdaq"

    def answered() -> subprocess.CompletedProcess[str] | None:
        got = segment.space.run(
            *["env", f"ECDAQ_RUN_DIR={segment.run_dir}", str(BIN / "ecdaq"), *words[1:]],
            check=False,
        )
        is_busy = got.returncode == REFUSED and "being brought up" in got.stderr
        return None if is_busy else got

    return wait_for(f"answer to {command}", answered, 60)


def look(segment: Segment, title: str, *expected: str, codes: dict[str, int] | None = None) -> str:
    """What the first block of the section prints, with all of the patterns @expected in it. While
    ecdaqd tries a bring-up by itself, they are not all there."""

    def shows() -> str:
        shown = ""
        for command in blocks(title)[0]:
            got = run(segment, command)
            shown += got.stdout + got.stderr
            if got.returncode != (codes or {}).get(command, 0):
                shown += f"{command}: exit code {got.returncode}\n"
        last[0] = shown
        is_all = all(re.search(pattern, shown) for pattern in expected)
        return shown if is_all and ": exit code " not in shown else ""

    last = [""]
    try:
        return wait_for("text", shows, 30)
    except NeverError:
        missing = [pattern for pattern in expected if not re.search(pattern, last[0])]
        raise AssertionError((missing, last[0])) from None


def repair(segment: Segment, title: str) -> None:
    """The second block of the section leads to OP."""
    for command in blocks(title)[1]:
        got = run(segment, command)
        assert got.returncode == 0, (command, got.stderr)
    segment.wait_for_op()
    assert segment.stop("daemon") == 0


def waiting(segment: Segment, text: str, *sim: str) -> Path:
    """The file, when ecdaqd with @text in it has begun to wait."""
    file = segment.folder / "ecdaq.yaml"
    file.write_text(text)
    segment.start_sim(*sim)
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 60)
    return file


NAMES = "slaves:\n  - {name: head}\n  - name: ai\n"


def test_the_page_has_the_five_causes_and_each_ends_with_the_way_out() -> None:
    titles = re.findall(r"^## (.*)$", PAGE.read_text(), re.MULTILINE)
    assert len(titles) == 5
    for title in titles:
        assert blocks(title)[0][0] == "ecdaq state"
        assert blocks(title)[1][0] == "ecdaq config reload"


def test_pdos_that_do_not_fit(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves="ek1100,el3104")
    twice = (
        "    sdo:\n"
        '      - "PS 0x1C13:0 USINT = 0"\n'
        '      - "PS 0x1C13:1 UINT = 0x1A00"\n'
        '      - "PS 0x1C13:2 UINT = 0x1A00"\n'
        '      - "PS 0x1C13:0 USINT = 2"\n'
    )
    file = waiting(segment, NAMES + twice)
    look(
        segment,
        "The PDOs do not fit",
        "AL status code 0x0024: invalid input mapping",
        r"look: ecdaq pdo ai; change: slaves\[\].pdos",
        "TxPDO 0x1a00  32 bits, ASSIGNED 2 TIMES",
    )
    file.write_text(NAMES)
    repair(segment, "The PDOs do not fit")


def test_a_wrong_start_up_sdo(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves="ek1100,el3104")
    file = waiting(segment, NAMES + '    sdo:\n      - "PS 0x9999:1 USINT = 1"\n')
    shown = look(
        segment,
        "A start-up SDO is wrong",
        r"slave 1 \(ai\): start-up SDO 0x9999:01 at PS = 0x1 ",
        f"{file}:5\\) rejected: abort 0x06020000, object does not exist",
        "0x6000 ",
    )
    assert not re.search("^ *0x9999", shown, re.MULTILINE)
    file.write_text(NAMES)
    repair(segment, "A start-up SDO is wrong")


def test_missing_clocks(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment()
    names = "slaves:\n  - {name: front}\n  - {name: rear}\n"
    file = waiting(segment, names + "dc: {enable: off}\n")
    look(
        segment,
        "Distributed clocks are missing",
        "AL status code 0x0030: invalid DC SYNC configuration",
        r"look: ecdaq slaves -v front \(SYNC0 cycle, DC\); change: dc.enable",
        "SYNC0 cycle +none",
    )
    file.write_text(names)
    repair(segment, "Distributed clocks are missing")


def lose_frames_until_the_alarm(segment: Segment, control: Path) -> None:
    """The watchdogs expire as often as it takes: by 30 ms without frames, and by themselves, as a
    busy machine may stretch the time between."""

    def is_alarm() -> bool:
        assert tell(control, "at=0s for=30ms lose") == "ok"
        for slave in (0, 1):
            assert tell(control, f"at=60ms watchdog slave={slave}") == "ok"
        return "not tried again" in segment.status()["message"]

    wait_for("alarm", is_alarm, 120)


def is_quiet(segment: Segment) -> bool:
    before = segment.status()["frames_lost"]
    return segment.wait_for_cycles(300, 60)["frames_lost"] - before < 20


def test_a_watchdog_that_expires(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment()
    names = "slaves:\n  - {name: front}\n  - {name: rear}\n"
    file = segment.folder / "ecdaq.yaml"
    file.write_text(names + "bus: {watchdog: 10ms, recovery_attempts: 1}\n")
    control = segment.folder / "control"
    segment.start_sim("--control", str(control))
    segment.start_waiting_daemon("--config", str(file))
    segment.wait_for_op()
    lose_frames_until_the_alarm(segment, control)
    look(
        segment,
        "The watchdog expires",
        "AL status code 0x001b: SyncManager watchdog",
        "for as long as bus.watchdog: frames are lost or late",
        r"frames +sent \d+ +lost [1-9]",
        r"(front|rear): OP -> SAFE-OP\+ERROR, AL status code 0x001b",
    )
    wait_for("frames that come back", lambda: is_quiet(segment), 60)
    file.write_text(names)
    repair(segment, "The watchdog expires")


def test_a_wrong_module(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves="ek1100,el3204,el2004")
    # An EL3104 was meant.
    names = NAMES + "    product: PRODUCT\n  - {name: valves}\n"
    file = waiting(segment, names.replace("PRODUCT", "0x0c203052"))
    title = "A wrong module is plugged in"
    shown = look(
        segment,
        title,
        "message    slave 1 ai: wrong identity: expected ",
        rf"{file}:3: slave 1 ai: device: expected vendor any product 0x0c203052 .*"
        r"found vendor 0x00000002 product 0x0c843052 .*\(EL3204 ",
        codes={"ecdaq config diff": DIFFERS},
    )
    product = re.findall(r"name: ai\n    vendor: .*\n    product: (\w+)", shown)
    assert product == ["0x0c843052"]
    file.write_text(names.replace("PRODUCT", product[0]))
    repair(segment, title)
