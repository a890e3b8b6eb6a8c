# SPDX-License-Identifier: MIT
"""ecdaq config: what is in effect, what is wrong with a file, what differs on the bus."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import (
    BIN,
    CONFIG,
    FAILED,
    NO_DAEMON,
    OK,
    REFUSED,
    ROOT,
    USAGE,
    Fake,
    ecdaq,
    fails,
    json_lines,
    json_of,
    works,
)

SLAVES = 9
SDO_KEYS = ("transition", "index", "subindex", "complete", "type", "value", "comment")
SAMPLE = ROOT / "app/doc/reference/ecdaq.sample.yaml"
FILE = """\
cycle:
  period: 2ms
record:
  dir: "/data/x: y"
slaves:
  - name: front
    vendor: 2
    sdo:
      - {index: 0x8000, subindex: 2, type: UINT, value: 10}
      - {index: 0x8001, type: REAL, value: 1.5}
      - "SO 0x8002:01 complete OCTETS = 01 0a  # all of it"
    channels:
      - {match: "0x6000:01", name: pressure, unit: "%", scale: 0.5, max: 10}
  - name: rear
    pdos:
      - 0x1a01
      - {pdo: 0x1600, entries: "0x7000:01 8, gap 8"}
    outputs:
      - {channel: lamp, owner: program}
outputs:
  - channel: rear.led
    owner: remote
    timeout: 100ms
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "ecdaq.yaml"
    path.write_text(FILE)
    return path


def shown(*words: str | Path) -> dict[str, dict[str, object]]:
    lines = json_lines(ecdaq(None, "config", "show", "--json", *map(str, words)))
    return {line["option"]: line for line in lines}


def test_show_has_value_unit_and_origin_of_every_option(file: Path) -> None:
    options = shown(file, "--set", "cycle.priority=70")
    period = options["cycle.period"]
    assert period == {
        "option": "cycle.period",
        "value": "2ms",
        "unit": "ms",
        "origin": "file",
        "takes_effect": "restart of ecdaqd",
        "file": str(file),
        "line": 2,
        "default": "1ms",
    }
    assert options["cycle.priority"]["origin"] == "command line"
    assert options["bus.scan_timeout"]["origin"] == "default"
    assert options["slaves[0].sdo[1].value"]["value"] == "1.5"
    line = {key: options[f"slaves[0].sdo[2].{key}"]["value"] for key in SDO_KEYS}
    assert line == {
        "transition": "SO",
        "index": "0x8002",
        "subindex": "0x01",
        "complete": "true",
        "type": "OCTETS",
        "value": "01 0a",
        "comment": "all of it",
    }
    assert options["slaves[0].sdo[0].transition"]["origin"] == "default"
    assert options["slaves[0].channels[0].match"]["value"] == "0x6000:01"
    assert options["slaves[0].channels[0].unit"]["value"] == "%"
    assert options["slaves[1].pdos[0].pdo"]["value"] == "0x1a01"
    assert options["slaves[1].pdos[1].entries"]["value"] == "0x7000:01 8, gap 8"
    assert options["slaves[1].name"]["value"] == "rear"
    assert options["slaves[1].outputs[0].channel"]["value"] == "lamp"
    assert options["slaves[1].outputs[0].owner"]["value"] == "program"
    assert options["outputs[0].owner"]["value"] == "remote"
    reference = (ROOT / "app/doc/reference/options.md").read_text()
    names = {line.split("`")[1] for line in reference.splitlines() if line.startswith("| `")}
    numbers = str.maketrans("", "", "0123456789")
    assert {option.translate(numbers) for option in options} >= {
        name.translate(numbers) for name in names
    }


@pytest.mark.parametrize("config", [None, SAMPLE, FILE], ids=["defaults", "sample", "lists"])
def test_what_show_prints_loads_and_is_the_same(tmp_path: Path, config: Path | str | None) -> None:
    first = tmp_path / "first.yaml"
    first.write_text(config.read_text() if isinstance(config, Path) else config or "")
    second = tmp_path / "second.yaml"
    second.write_text(works(ecdaq(None, "config", "show", str(first))))
    assert works(ecdaq(None, "config", "check", str(second))) == f"{second}: valid\n"
    before, after = shown(first), shown(second)
    assert before.keys() == after.keys()
    for option, line in before.items():
        assert after[option]["value"] == line["value"], option


def test_show_says_where_a_value_is_from(file: Path) -> None:
    lines = works(ecdaq(None, "config", "show", str(file))).splitlines()
    assert lines[0] == f"# {file}"
    period = next(line for line in lines if line.startswith("  period:"))
    assert period.split("#")[1].strip() == "line 2; default 1ms"
    assert '  dir: "/data/x: y"' in "\n".join(lines)
    assert next(x for x in lines if "scan_timeout" in x).endswith("# default")


def test_check_reports_every_problem_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("cycle:\n  period: 20ms\n  perid: 1\nslaves:\n  - nmae: x\n")
    result = ecdaq(None, "config", "check", str(file))
    fails(result, CONFIG, f"{file}: 3 problems")
    lines = result.stdout.splitlines()
    assert [line[len(str(file)) :].split(":")[1] for line in lines] == ["2", "3", "5"]
    assert lines[1] == f"{file}:3: cycle.perid: unknown option; did you mean cycle.period?"
    found = ecdaq(None, "config", "check", "--json", str(file))
    assert found.returncode == CONFIG
    assert '"line":3,"problem":"cycle.perid: unknown option' in found.stdout


def test_check_takes_what_ecdaqd_takes_and_no_more(file: Path, tmp_path: Path) -> None:
    assert works(ecdaq(None, "config", "check", str(file))) == f"{file}: valid\n"
    assert works(ecdaq(None, "--config", str(file), "config", "check")) == f"{file}: valid\n"
    bad = tmp_path / "bad.yaml"
    bad.write_text("cycle:\n  perid: 1\n")
    fails(ecdaq(None, "--config", str(bad), "config", "check"), CONFIG, "1 problem")
    got = subprocess.run(
        [BIN / "ecdaqd", "--check", "--config", bad], capture_output=True, text=True, check=False
    )
    assert got.returncode == CONFIG
    assert got.stderr == f"ecdaqd: {ecdaq(None, 'config', 'check', str(bad)).stdout}"


def test_a_file_that_is_not_there_is_named() -> None:
    for word in ("show", "check"):
        fails(ecdaq(None, "config", word, "/absent.yaml"), CONFIG, "/absent.yaml: cannot read")


def test_what_is_set_over_the_file_is_checked_too(file: Path) -> None:
    got = ecdaq(None, "config", "check", str(file), "--set", "cycle.period=9s", "--set", "x=1")
    fails(got, CONFIG, "2 problems")
    assert got.stdout.splitlines()[1] == "x: unknown option"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "missing show|check|diff"),
        (["print"], "print: expected show, check, diff, reload or schema"),
        (["diff", "a.yaml"], "diff: takes no file and no --set"),
        (["diff", "--set", "cycle.period=1ms"], "diff: takes no file and no --set"),
    ],
)
def test_mistakes(words: list[str], message: str) -> None:
    fails(ecdaq(Path("/nonexistent"), "config", *words), USAGE, message)


def test_without_ecdaqd_there_is_nothing_to_compare(run_dir: Path) -> None:
    fails(ecdaq(run_dir, "config", "diff"), NO_DAEMON, "is ecdaqd running?")


def test_diff_shows_every_difference_with_file_and_line(fake: Callable[..., Fake]) -> None:
    daemon = fake("ADMIN=differs")
    result = daemon("config", "diff")
    fails(result, SLAVES, "2 differences between configuration and bus")
    assert result.stdout.splitlines() == [
        "/etc/ecdaq.yaml:7: slave 1 rear (group axes): revision: expected 0x00000002,"
        " found 0x00000001 (position 1)",
        "position 2 EL?[31m: not configured: vendor 0x00000002",
    ]
    result = daemon("config", "diff", "--json")
    assert result.returncode == SLAVES
    assert (
        '{"kind":"identity","note":false,"name":"rear","group":"axes","item":1,"position":1'
        in result.stdout
    )


def test_other_pdos_are_a_difference_of_the_slave(fake: Callable[..., Fake]) -> None:
    daemon = fake("ADMIN=mapped")
    result = daemon("config", "diff")
    fails(result, SLAVES, "2 differences between configuration and bus")
    assert result.stdout.splitlines() == [
        "/etc/ecdaq.yaml:5: slave 0 front: other PDOs assigned: expected 0x1a01,"
        " found 0x1a00, 0x1a01",
        "/etc/ecdaq.yaml:9: output rear.nope: no such output: expected an output channel,"
        " found no channel of this name",
    ]
    result = daemon("config", "diff", "--json")
    assert '"kind":"pdos","note":false,"name":"front","group":null,"item":0' in result.stdout
    assert '"kind":"output","note":false,"name":"rear.nope","group":null,"item":0' in (
        result.stdout
    )


def test_an_absent_optional_slave_is_no_difference(daemon: Fake) -> None:
    result = daemon("config", "diff")
    assert result.returncode == OK
    assert result.stdout.splitlines() == [
        "slave 3 spare: absent, optional: expected vendor any",
        "configuration and bus agree",
    ]
    assert [one["kind"] for one in json_of(daemon("config", "diff", "--json"))] == ["optional"]


def test_half_a_difference_is_refused(fake: Callable[..., Fake]) -> None:
    fails(fake("ADMIN=half")("config", "diff"), FAILED, "a list of differences of 172 bytes")


def test_reload_shows_what_changed_and_what_it_needs(fake: Callable[..., Fake]) -> None:
    daemon = fake("ADMIN=differs")
    assert works(daemon("config", "reload")).splitlines() == [
        "bus.op_timeout: 10s -> 5s: in effect",
        'eoe.interface: "" -> e?[31m: needs a restart of ecdaqd',
    ]
    assert json_of(daemon("config", "reload", "--json")) == [
        {
            "option": "bus.op_timeout",
            "old": "10s",
            "new": "5s",
            "in_effect": True,
            "needs": None,
        },
        {
            "option": "eoe.interface",
            "old": "",
            "new": "e\x1b[31m",
            "in_effect": False,
            "needs": "restart of ecdaqd",
        },
    ]


def test_reload_without_a_change_says_so(daemon: Fake) -> None:
    said = works(daemon("config", "reload"))
    assert said == "/etc/ecdaq.yaml: no option has another value\n"
    assert json_of(daemon("config", "reload", "--json")) == []


def test_reload_of_a_wrong_file_is_an_error_of_the_configuration(
    fake: Callable[..., Fake],
) -> None:
    fails(fake("ADMIN=wrong")("config", "reload"), CONFIG, "/etc/ecdaq.yaml:3: cycle.perid: no")
    fails(fake("ADMIN=half")("config", "reload"), FAILED, "a list of changes of 839 bytes")


def test_reload_without_ecdaqd_is_an_error(run_dir: Path) -> None:
    fails(ecdaq(run_dir, "config", "reload"), NO_DAEMON, "is ecdaqd running?")


def test_reload_takes_no_file(daemon: Fake) -> None:
    fails(daemon("config", "reload", "other.yaml"), USAGE, "takes no file and no --set")


def test_refused_is_refused(fake: Callable[..., Fake]) -> None:
    assert fake("ADMIN=garbage")("config", "diff").returncode in (FAILED, REFUSED)
