# SPDX-License-Identifier: MIT
"""Slaves selected by --position and --alias, with the grammar of IgH's ethercat."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import FAILED, OK, REFUSED, ROOT, USAGE, Fake, ecdaq, fails, json_lines, json_of, works


@pytest.fixture
def five(fake: Callable[..., Fake]) -> Fake:
    """Aliases 1000 to 1004."""
    return fake("BRANCHES=1", "ALIASES=1000,1001,1002,1003,1004")


@pytest.mark.parametrize(
    ("words", "positions"),
    [
        (["-p", "1"], [1]),
        (["-p1"], [1]),
        (["--position=0x2"], [2]),
        (["-p", "0,2-3"], [0, 2, 3]),
        (["-p", "3-1"], [3, 2, 1]),
        (["-p", "3-"], [3, 4]),
        (["-p", "-1"], [0, 1]),
        (["-p", "-"], [0, 1, 2, 3, 4]),
        (["-a", "-"], [0, 1, 2, 3, 4]),
        (["-p", "2,0-2,2"], [2, 0, 1]),
        (["-a", "1003"], [3]),
        (["-a", "1001-1002,1000"], [1, 2, 0]),
        (["-a", "1003-"], [3, 4]),
        (["-a", "1001", "-p", "0"], [1]),
        (["-a", "1001", "-p", "1-2"], [2, 3]),
        (["-a", "1003", "-p", "0-9"], [3, 4]),
    ],
    ids=lambda words: " ".join(map(str, words)),
)
def test_lists_and_ranges_of_positions_and_aliases(
    five: Fake, words: list[str], positions: list[int]
) -> None:
    shown = json_of(five("slaves", "--json", *words))
    assert [slave["name"] for slave in shown] == [f"piccolo{pos}" for pos in positions]


def test_a_group_is_all_of_its_slaves(five: Fake) -> None:
    for words, positions in ((["@axes"], [1, 3]), (["@axes", "0"], [1, 3, 0])):
        shown = json_of(five("slaves", "--json", *words))
        assert [slave["name"] for slave in shown] == [f"piccolo{pos}" for pos in positions]
    assert [slave["group"] for slave in json_of(five("slaves", "--json"))] == [
        "", "axes", "", "axes", ""
    ]  # fmt: skip
    assert "group            axes" in works(five("slaves", "-v", "1"))
    assert "group" not in works(five("slaves", "-v", "0"))
    fails(five("slaves", "@drives"), FAILED, "@drives: no slave is of this group (slaves[].group)")
    fails(five("slaves", "@"), FAILED, "@: no slave is of this group")
    fails(five("sdo", "read", "@axes", "0x1000"), FAILED, "@axes: is a group, and one slave is")


def test_without_positions_an_alias_goes_on_to_the_next_one(fake: Callable[..., Fake]) -> None:
    daemon = fake("BRANCHES=1", "ALIASES=0,7,0,9,0")
    for words, positions in (
        (["-a", "7"], [1, 2]),
        (["-a", "7", "-p0"], [1]),
        (["-a", "9"], [3, 4]),
        (["-a", "9", "-p", "1"], [4]),
    ):
        shown = json_of(daemon("slaves", "--json", *words))
        assert [slave["name"] for slave in shown] == [f"piccolo{pos}" for pos in positions], words


@pytest.mark.parametrize(
    "words",
    ["", "x", "1,", ",1", "1,,2", "1-2-3", "65536", "1;2", "0x", "--", "1 2", "9" * 40],
)
@pytest.mark.parametrize("option", ["--position", "--alias"])
def test_wrong_grammar_is_one_line_and_exit_code_2(option: str, words: str) -> None:
    nowhere = Path("/nonexistent")
    fails(ecdaq(nowhere, "slaves", f"{option}={words}"), USAGE, option)


def test_slaves_that_are_not_there_are_named(five: Fake) -> None:
    fails(five("slaves", "-p", "5"), FAILED, "--position: no slave at position 5, there are 5")
    fails(five("slaves", "-p", "3-7"), FAILED, "--position: no slave at position 5")
    fails(five("slaves", "-p", "7-"), FAILED, "--position: no slave at position 7")
    fails(five("slaves", "-a", "99"), FAILED, "--alias: 99: no such slave (see ecdaq slaves)")
    fails(five("slaves", "-a", "1004", "-p", "1"), FAILED, "--alias: 1004: no such slave")


def test_a_verb_of_one_slave_is_run_for_each(five: Fake) -> None:
    shown = json_lines(five("sdo", "read", "0x1018:1", "--json", "-p", "2,0"))
    assert [slave["slave"] for slave in shown] == [2, 0]
    text = works(five("sdo", "read", "-p", "0,1", "0x1018:1")).splitlines()
    assert (text[0], text[2], len(text)) == ("slave 0", "slave 1", 4)
    assert len(works(five("sdo", "-a1001", "read", "0x1018:1")).splitlines()) == 1


def test_the_first_failure_ends_it(five: Fake) -> None:
    result = five("reg", "read", "0x130", "--json", "-p", "0-")
    assert result.returncode == REFUSED
    assert json.loads(result.stdout)["slave"] == 0
    assert (
        result.stderr.startswith("ecdaq: reg: refused: slave 1") and result.stderr.count("\n") == 1
    )


def test_words_in_place_of_a_selection_are_refused(five: Fake) -> None:
    fails(five("slaves", "piccolo0", "-p", "1"), USAGE, "piccolo0: SLAVE excludes --position")
    fails(five("sii", "read", "piccolo0", "-p", "1"), USAGE, "read: expected SLAVE")
    fails(five("state", "-p", "1"), USAGE, "missing [STATE [SLAVE...|all]]")
    fails(five("status", "-p", "1"), USAGE, "-p: unknown option")


def test_one_file_does_not_take_what_several_slaves_give(five: Fake, tmp_path: Path) -> None:
    file = tmp_path / "sii.bin"
    fails(
        five("sii", "read", "-p", "0,1", "-o", str(file)),
        USAGE,
        "--output: one slave at a time, 2 are selected",
    )
    assert not file.exists()
    assert five("sii", "read", "-p", "0", "-o", str(file)).returncode == OK
    assert file.stat().st_size > 0


def test_every_verb_with_a_slave_takes_positions_and_aliases() -> None:
    text = works(ecdaq(None, "--help"))
    verbs = [line.split()[0] for line in text.splitlines() if line.startswith("  ")]
    table = (ROOT / "app/cli/main.c").read_text()
    for verb in {v for v in verbs if f'{{ "{v}",' in table} - {"log", "security"}:
        text = works(ecdaq(None, verb, "--help"))
        assert ("SLAVE" in text.splitlines()[0]) == ("-p, --position LIST" in text), verb
