# SPDX-License-Identifier: MIT
"""The command line of ecdaq: help, versions, mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest
from ecdaq import CONFIG, NO_DAEMON, OK, ROOT, USAGE, Fake, ecdaq, fails, works

VERBS = {
    "status": "",
    "top": "",
    "slaves": "[SLAVE...]",
    "topology": "[SLAVE...]",
    "channels": "",
    "data": "[SLAVE...]",
    "cstruct": "",
    "watch": "CHANNEL...",
    "set": "OUTPUT=VALUE...",
    "oneshot": "SLAVE|all",
    "state": "[STATE [SLAVE...|all]]",
    "rescan": "",
    "sdo": "read|write|list|startup SLAVE",
    "pdo": "[SLAVE...]",
    "soe": "read|write|list SLAVE",
    "eoe": "ip SLAVE",
    "aoe": "read|write SLAVE",
    "voe": "SLAVE BYTES",
    "reg": "read|write",
    "sii": "read|show|write|alias",
    "foe": "read|write SLAVE NAME|FILE",
    "firmware": "SLAVE FILE",
    "scan": "",
    "eni": "write|check|import [FILE]",
    "xml": "[SLAVE...]",
    "esi": "FILE|DIR...",
    "config": "show|check|diff",
    "crc": "[SLAVE...]",
    "domains": "[SLAVE...]",
    "pcap": "",
    "events": "",
    "sync0": "[calibrate]",
    "histogram": "wake|",
    "metrics": "",
    "doctor": "",
    "clear": "",
    "web-token": "viewer|operator|engineer",
    "stop": "",
    "completion": "",
    "manual": "[VERB]",
    "help": "[VERB]",
    "version": "",
}
READING = [
    ["status"],
    ["status", "--summary"],
    ["slaves"],
    ["topology"],
    ["channels"],
    ["data"],
    ["cstruct"],
    ["watch", "piccolo0.adc", "--count", "1"],
    ["histogram", "wake"],
    ["state"],
    ["sdo", "read", "0", "0x1018:1"],
    ["sdo", "list", "0"],
    ["pdo"],
    ["scan"],
    ["soe", "read", "0", "1"],
    ["soe", "list", "0"],
    ["eoe", "ip", "0"],
    ["aoe", "read", "0", "0x1018:1", "--port", "1"],
    ["voe", "0", "01"],
    ["foe", "read", "0", "a.bin"],
    ["reg", "read", "0", "0x0130"],
    ["sii", "read", "0"],
    ["crc", "0"],
    ["domains", "0"],
    ["pcap"],
]


def test_help_names_every_verb_and_the_exit_codes() -> None:
    text = works(ecdaq(None, "--help"))
    for verb in [*VERBS, "log", "security"]:
        assert f"\n  {verb} " in text
    assert "\n  16  no ecdaqd" in text
    assert max(len(line) for line in text.splitlines()) <= 100


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb: str) -> None:
    text = works(ecdaq(None, verb, "--help"))
    assert text.startswith(f"usage: ecdaq {verb}")
    assert VERBS[verb] in text.splitlines()[0]


def test_the_manual_names_every_verb_and_every_option() -> None:
    manual = (ROOT / "app/doc/reference/cli.md").read_text()
    for verb in VERBS:
        assert f"`ecdaq {verb}" in manual, verb
        for word in works(ecdaq(None, verb, "--help")).split():
            if word.startswith("--"):
                assert f"`{word.rstrip(',')}" in manual, (verb, word)


def test_versions_agree() -> None:
    version = works(ecdaq(None, "--version"))
    assert version.startswith("ecdaq ") and version.count("\n") == 1
    assert works(ecdaq(None, "version")) == version


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "missing command"),
        (["frob"], "frob: unknown command"),
        (["--frob"], "--frob: unknown option"),
        (["--run-dir"], "--run-dir: missing value"),
        (["status", "--frob"], "status: --frob: unknown option"),
        (["status", "word"], "status: word: unexpected argument"),
        (["status", "--json=1"], "--json: takes no value"),
        (["watch"], "watch: missing CHANNEL..."),
        (["watch", "a", "--count", "0"], '--count: "0": expected a whole number above 0'),
        (["watch", "a", "--rate", "-1"], '--rate: "-1": expected a number above 0'),
        (["watch", "a", "--window", "1furlong"], '--window: unknown unit "furlong"'),
        (["watch", "a", "--plot", "--json"], "--plot and --json exclude each other"),
        (["watch", "a", "--rate", "2", "--every", "2"], "--rate and --every"),
        (["set"], "set: missing OUTPUT=VALUE..."),
        (["oneshot", "all"], "oneshot: requires --at or --in"),
        (["oneshot", "all", "--at", "1", "--in", "1s"], "oneshot: requires --at or --in"),
        (["oneshot", "--in", "1s"], "oneshot: missing SLAVE|all"),
        (["sdo", "peek", "0", "0x1018"], "peek: expected read, write, list or startup"),
        (["sdo", "read", "0", "0x1018:1", "5"], "read: expected SLAVE INDEX:SUB"),
        (["sdo", "write", "0", "0x1018:1"], "write: expected SLAVE INDEX:SUB VALUE"),
        (["sdo", "read", "0", "0x1018:1:2"], "expected INDEX:SUB such as"),
        (["sdo", "read", "0", "0x10180"], "expected INDEX:SUB such as"),
        (["sdo", "read", "0", "0x1018:256"], "expected INDEX:SUB such as"),
        (["sdo", "read", "0", "0x1018", "--type", "U8"], "--type: U8: expected one of BOOL|SINT"),
        (["sdo", "read", "0", "0x1018:2", "--complete"], "--complete: expected subindex 0 or 1"),
        (["sdo", "write", "0", "0x1018", "5", "--complete"], "5: expected bytes in hex"),
        (["sdo", "write", "0", "1", "5", "--complete", "-t", "INT"], "hex, without --type"),
        (["sdo", "list", "0", "--complete"], "list: has no option --complete"),
        (["sdo", "startup", "0", "-t", "INT"], "startup: has no option --type"),
        (["sdo", "startup", "0", "0x1018"], "startup: expected SLAVE"),
        (["sdo", "list", "0", "0x1018", "1"], "list: expected SLAVE [INDEX:SUB]"),
        (["sdo", "list", "0", "x"], "expected INDEX:SUB such as"),
        (["sdo", "list", "0", "--count", "1"], "list: --count is of --indices, or of an object"),
        (["sdo", "read", "0", "0x1018", "--count", "1"], "read: has no option --count"),
        (["sdo", "startup", "0", "--indices"], "startup: has no option --indices"),
        (["soe", "peek", "0"], "peek: expected read, write or list"),
        (["soe", "read", "0"], "read: expected SLAVE IDN"),
        (["soe", "write", "0", "1"], "write: expected SLAVE IDN VALUE"),
        (["soe", "read", "0", "S-0"], "S-0: expected an IDN such as S-0-0017"),
        (["soe", "read", "0", "65536"], "65536: expected an IDN"),
        (["soe", "read", "0", "1", "--drive", "8"], "--drive"),
        (["eoe", "mac", "0"], "mac: expected ip"),
        (["eoe", "ip", "0", "--gateway", "1.2.3.4.5"], "--gateway: 1.2.3.4.5: is not valid"),
        (["aoe", "read", "0", "0x1018:1"], "--port is missing"),
        (["aoe", "write", "0", "1:1", "5", "--port", "1"], "write: --type must be one of BOOL"),
        (["voe", "0"], "voe: missing SLAVE BYTES"),
        (["voe", "0", "1"], "1: expected bytes in hex, two digits each"),
        (["foe", "peek", "0", "a"], "peek: expected read or write"),
        (["foe", "read", "0"], "foe: missing"),
        (["foe", "read", "0", "a", "--name", "b"], "read: has no option --name"),
        (["foe", "write", "0", "a", "-o", "b"], "write: has no option --output"),
        (["foe", "write", "0", "a", "--password", "x"], "--password"),
        (["firmware", "0"], "firmware: missing"),
        (["firmware", "0", "a/"], "a file of a slave has a name of 1 to 63 bytes (--name)"),
        (["firmware", "0", "a", "--name", "x" * 64], "a name of 1 to 63 bytes (--name)"),
        (["data", "--json", "--output", "x"], "--output and --json exclude each other"),
        (["cstruct", "--name", "7a"], "--name: 7a: expected a C name of up to 40 characters"),
        (["cstruct", "--name", "a" * 41], "expected a C name of up to 40 characters"),
        (["cstruct", "--name", "a-b"], "--name: a-b: expected a C name"),
        (["cstruct", "x"], "cstruct: x: unexpected argument"),
        (["pcap", "--json"], "--json requires --output"),
        (["pcap", "--count", "0"], "--count"),
        (["events", "--level", "loud"], "--level: loud: expected info"),
        (["events", "--kind", "frame"], "--kind: frame: no such event"),
        (["top", "--sort", "size"], "--sort: size: expected trouble"),
        (["line\nbreak"], "line?break: unknown command"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(words: list[str], message: str) -> None:
    fails(ecdaq(Path("/nonexistent"), *words), USAGE, message)


def test_the_wrong_histogram_is_named(daemon: Fake) -> None:
    fails(
        daemon("histogram", "sleep"),
        USAGE,
        "sleep: expected wake, round-trip, phase, work or control",
    )


@pytest.mark.parametrize("words", READING, ids=" ".join)
def test_without_ecdaqd_a_reading_verb_reports_it(run_dir: Path, words: list[str]) -> None:
    fails(ecdaq(run_dir, *words), NO_DAEMON, str(run_dir), "is ecdaqd running?")


@pytest.mark.parametrize("words", [["clear"], ["stop"]], ids=" ".join)
def test_without_ecdaqd_a_command_reports_it(run_dir: Path, words: list[str]) -> None:
    fails(ecdaq(run_dir, *words), NO_DAEMON, "admin", "is ecdaqd running?")


def test_top_can_wait_for_ecdaqd(run_dir: Path) -> None:
    fails(ecdaq(run_dir, "top", "--wait", "100ms"), NO_DAEMON, "is ecdaqd running?")


def test_the_run_directory_comes_from_option_configuration_and_environment(
    daemon: Fake, tmp_path: Path
) -> None:
    nowhere = Path("/nonexistent")
    config = tmp_path / "ecdaq.yaml"
    config.write_text(f"runtime:\n  run_dir: {daemon.run_dir}\n")
    where = str(daemon.run_dir)
    for words in (
        ["--run-dir", where, "slaves"],
        [f"--run-dir={where}", "slaves"],
        ["slaves", "--run-dir", where],
        ["--config", str(config), "slaves"],
        ["--config", "/dev/null", "--run-dir", where, "slaves"],
    ):
        assert "piccolo1" in works(ecdaq(nowhere, *words))
    assert ecdaq(nowhere, "slaves").returncode == NO_DAEMON


def test_a_broken_configuration_is_named_with_its_line(tmp_path: Path) -> None:
    config = tmp_path / "ecdaq.yaml"
    config.write_text("runtime:\n  rundir: /x\n")
    fails(
        ecdaq(None, "--config", str(config), "status"),
        CONFIG,
        f"{config}:2: runtime.rundir: unknown option; did you mean runtime.run_dir?",
    )


def test_a_full_disk_is_a_failure(daemon: Fake) -> None:
    with Path("/dev/full").open("w") as full:
        process = daemon.start("slaves", stdout=full, stderr=-1)
        _, message = process.communicate(timeout=60)
    assert process.returncode != OK
    assert message == "ecdaq: slaves: standard output: No space left on device\n"
