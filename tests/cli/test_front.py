# SPDX-License-Identifier: MIT
"""What all programs share: standard options, one form of errors, one table of exit codes."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from ecdaq import BIN, CONFIG, DISABLED, FAILED, OK, ROOT, USAGE, Result, environment

# Those that run until they are stopped, and the option that switches each on.
SERVICES = {
    "ecdaqd": None,
    "ecdaq-record": "record.enable",
    "ecdaq-dds": "dds.enable",
    "ecdaq-stream": "stream.enable",
    "ecdaq-sync0": "sync0.enable",
    "ecdaq-uplink": "uplink.enable",
    "ecdaq-web": "web.enable",
    "ecdaq-web-command": "web.enable",
}
PROGRAMS = [*SERVICES, "ecdaq"]
RUN_BY_ECDAQ = ["log", "security"]
STANDARD = [
    "--config FILE",
    "--set OPTION=VALUE",
    "--run-dir DIR",
    "--check",
    "--version",
    "--help",
]


def run(program: str, *words: str) -> Result:
    if not (BIN / program).exists():
        optional = ("ecdaq-dds", "ecdaq-stream", "ecdaq-uplink", "ecdaq-web")
        assert program in optional, f"{program} was not built"
        pytest.skip(f"{program} was not built")
    return subprocess.run(
        [BIN / program, *words],
        env=environment(None),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def one_line(program: str, result: Result, code: int, text: str) -> None:
    assert result.returncode == code, result
    assert result.stderr.startswith(f"{program}: ") and result.stderr.count("\n") == 1, result
    assert text in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("program", PROGRAMS)
def test_version_is_the_name_and_a_number(program: str) -> None:
    result = run(program, "--version")
    assert result.returncode == OK and result.stderr == ""
    assert re.fullmatch(rf"{program} \d+\.\d+\.\d+\n", result.stdout)


@pytest.mark.parametrize("program", PROGRAMS)
def test_help_fits_a_terminal_and_comes_with_either_spelling(program: str) -> None:
    result = run(program, "--help")
    assert result.returncode == OK and result.stderr == ""
    assert result.stdout.startswith(f"usage: {program} ")
    assert max(len(line) for line in result.stdout.splitlines()) <= 100
    assert run(program, "-h").stdout == result.stdout


@pytest.mark.parametrize("program", SERVICES)
def test_a_service_has_all_standard_options(program: str) -> None:
    text = run(program, "--help").stdout
    for option in STANDARD:
        assert re.search(rf"^  (?:-h, )?{option}( |$)", text, re.MULTILINE), option


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--foo"], "--foo: unknown option (see "),
        (["--run-dir"], "--run-dir: missing value (see "),
        (["--config="], "--config: missing value (see "),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_a_mistake_has_the_same_words_everywhere(program: str, words: list[str], text: str) -> None:
    one_line(program, run(program, *words), USAGE, text)


@pytest.mark.parametrize("program", SERVICES)
def test_an_argument_is_refused_by_a_service(program: str) -> None:
    one_line(program, run(program, "word"), USAGE, "word: unexpected argument (see ")


@pytest.mark.parametrize("program", SERVICES)
def test_check_reports_a_valid_file(program: str, tmp_path: Path) -> None:
    config = tmp_path / "ecdaq.yaml"
    config.write_text(
        f"record:\n  dir: {tmp_path}\ndds:\n  interface: lo\n  multicast: off\n"
        "stream:\n  servers: nats://127.0.0.1\n"
        "uplink:\n  endpoint: http://127.0.0.1\n  bucket: b\n"
        f"  credentials: {tmp_path}/key\n"
    )
    key = tmp_path / "key"
    key.touch(mode=0o600)
    key.write_text("aws_access_key_id = a\naws_secret_access_key = b\n")
    switch = SERVICES[program]
    enable = [] if switch is None else ["--set", f"{switch}=on"]
    result = run(program, "--check", "--config", str(config), *enable)
    assert result.returncode == OK, result
    assert result.stdout == f"{config}: valid\n"


@pytest.mark.parametrize("program", [p for p, switch in SERVICES.items() if switch is not None])
def test_check_distinguishes_a_disabled_program_from_an_invalid_file(program: str) -> None:
    off = f"{SERVICES[program]}=off"
    one_line(program, run(program, "--check", "--set", off), DISABLED, "is off: nothing to do")
    result = run(program, "--set", off)
    assert result.returncode == OK and "is off: nothing to do" in result.stderr


@pytest.mark.parametrize("program", SERVICES)
def test_an_unknown_configuration_option_gets_a_suggestion(program: str) -> None:
    result = run(program, "--check", "--set", "cycle.perid=1ms")
    one_line(program, result, CONFIG, "cycle.perid: unknown option; did you mean cycle.period?")


@pytest.mark.parametrize("program", SERVICES)
def test_overrides_come_before_the_check(program: str, tmp_path: Path) -> None:
    """A file that is invalid alone is valid with what is set over it, and the other way round."""
    config = tmp_path / "ecdaq.yaml"
    config.write_text("dds:\n  enable: on\nrecord:\n  enable: off\n")
    result = run(program, "--check", "--config", str(config))
    one_line(program, result, CONFIG, f"{config}:2: dds.interface: is required")
    options = ["--set", "dds.interface=lo", "--set", "dds.multicast=off"]
    result = run(program, "--check", "--config", str(config), *options)
    assert result.returncode in (OK, DISABLED), result


@pytest.mark.parametrize("program", SERVICES)
def test_the_run_directory_is_part_of_what_is_checked(program: str) -> None:
    result = run(program, "--check", "--run-dir", "/" + 300 * "x")
    one_line(program, result, CONFIG, "runtime.run_dir: ")


@pytest.mark.parametrize("verb", RUN_BY_ECDAQ)
def test_a_verb_that_is_a_program_gets_the_global_options(verb: str) -> None:
    globals_ = ["--run-dir", "/nonexistent", "--config", "/dev/null"]
    assert run("ecdaq", *globals_, verb, "--version").stdout.startswith(f"ecdaq-{verb} ")
    helped = run("ecdaq", verb, "--help")
    assert helped.returncode == OK and helped.stdout == run(f"ecdaq-{verb}", "--help").stdout
    assert helped.stdout.startswith(f"usage: ecdaq {verb}")
    for words, text in (([], "missing command: "), (["frob"], "frob: unknown command (see ")):
        one_line("ecdaq", run("ecdaq", *globals_, verb, *words), USAGE, f"ecdaq: {verb}: {text}")


def test_the_recordings_of_a_configuration_are_listed(tmp_path: Path) -> None:
    config = tmp_path / "ecdaq.yaml"
    config.write_text(f"record:\n  dir: {tmp_path / 'nowhere'}\n")
    for words in (
        ["--config", str(config), "log", "list"],
        ["log", "list", "--config", str(config)],
    ):
        one_line("ecdaq", run("ecdaq", *words), FAILED, f"{tmp_path / 'nowhere'}: ")


@pytest.mark.parametrize("verb", RUN_BY_ECDAQ)
def test_a_verb_whose_program_is_missing_is_named(verb: str, tmp_path: Path) -> None:
    alone = tmp_path / "ecdaq"
    shutil.copy(BIN / "ecdaq", alone)
    result = subprocess.run([alone, verb], capture_output=True, text=True, timeout=60, check=False)
    one_line("ecdaq", result, FAILED, f"{tmp_path}/ecdaq-{verb}: not installed")


def test_an_invalid_configuration_of_log_is_exit_code_3() -> None:
    result = run("ecdaq", "log", "list", "--config", "/nowhere/ecdaq.yaml")
    one_line("ecdaq", result, CONFIG, "log: --config: /nowhere/ecdaq.yaml: ")


def test_ecdaq_itself_links_neither_openssl_nor_zstd() -> None:
    libraries = subprocess.run(
        ["ldd", BIN / "ecdaq"], capture_output=True, text=True, check=True
    ).stdout
    assert "libc.so" in libraries
    assert not re.search("crypto|ssl|zstd", libraries)


def exit_codes(program: str) -> dict[int, str]:
    """The table at the end of --help."""
    table = run(program, "--help").stdout.split("exit codes:\n")[1]
    return {int(n): text for n, text in re.findall(r"^ +(\d+)  (.+)$", table, re.MULTILINE)}


def documented() -> list[tuple[int, str, str]]:
    page = (ROOT / "app/doc/reference/exit-codes.md").read_text()
    rows = re.findall(r"^\| (\d+) \| (.+?) \| (.+?) \|$", page, re.MULTILINE)
    return [(int(code), text, programs) for code, text, programs in rows]


def test_the_page_of_exit_codes_has_every_code_once() -> None:
    header = (ROOT / "app/core/program/exit_code.h").read_text()
    codes = [int(n) for n in re.findall(r"EXIT_CODE_[A-Z_]+ = (\d+),", header)]
    assert codes == list(range(len(codes))) and len(codes) >= 20
    assert [code for code, _, _ in documented()] == codes


@pytest.mark.parametrize("program", [*PROGRAMS, *(f"ecdaq-{verb}" for verb in RUN_BY_ECDAQ)])
def test_the_exit_codes_of_help_are_those_of_the_page(program: str) -> None:
    listed = {
        code: text
        for code, text, programs in documented()
        if programs == "all" or program in programs.split(", ")
    }
    assert exit_codes(program) == listed
