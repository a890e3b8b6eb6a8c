# SPDX-License-Identifier: MIT
"""A control program that cannot run: one line, what and why, before anything is on the wire."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from ecdaq import BIN, BUILD, STAGE, environment

PROGRAMS = BUILD / "tests" / "control"
CONFIG = 3
SANITIZE = ["-fsanitize=address,undefined"] if os.environ.get("ECDAQ_FLAVOUR") == "asan" else []


def daemon(run_dir: Path, *settings: str) -> subprocess.CompletedProcess[str]:
    words = [word for setting in settings for word in ("--set", setting)]
    return subprocess.run(
        [
            BIN / "ecdaqd",
            "--exit-on-failure",
            "--interface",
            "lo",
            "--run-dir",
            run_dir / "run",
            *words,
        ],
        env=environment(None),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def last_line(result: subprocess.CompletedProcess[str]) -> str:
    """The error; warnings about missing real-time rights may precede it."""
    assert result.returncode == CONFIG, result.stderr
    line = result.stderr.splitlines()[-1]
    assert line.startswith("ecdaqd: ")
    return line.removeprefix("ecdaqd: ")


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("/nowhere/blink.so", "No such file or directory"),
        ("blink.so", "expected a path with a slash"),
        ("/tmp", "is not a file"),
        (f"{PROGRAMS}/no_symbol.so", "has no symbol ecdaq_program"),
        (f"{PROGRAMS}/other_abi.so", "was built for version 3 of ecdaq/control.h"),
        (f"{PROGRAMS}/missing_symbol.so", "undefined symbol: function_that_is_nowhere"),
        (f"{PROGRAMS}/no_cycle.so", "ecdaq_program has no cycle()"),
    ],
)
def test_a_program_that_cannot_be_loaded_is_reported(
    tmp_path: Path, program: str, message: str
) -> None:
    line = last_line(daemon(tmp_path, f"control.program={program}"))
    assert line.startswith(f"control: {program}: ") and message in line


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["control.budget=1ms"], "control.budget: must be below cycle.period"),
        (["control.options=kp"], 'control.options: "kp" is not KEY=VALUE'),
        (["control.overrun=sometimes"], "control.overrun"),
        (["control.stuck=1ms"], "control.stuck"),
    ],
)
def test_settings_that_do_not_fit_are_reported(
    tmp_path: Path, settings: list[str], message: str
) -> None:
    program = f"control.program={PROGRAMS}/probe.so"
    assert message in last_line(daemon(tmp_path, program, *settings))


@pytest.mark.parametrize("example", ["blink", "pi_loop", "loopback"])
def test_the_configuration_of_an_example_is_good(example: str) -> None:
    config = STAGE / "share" / "ecdaq" / "examples" / example / "ecdaq.yaml"
    result = subprocess.run(
        [BIN / "ecdaqd", "--check", "--config", config],
        env=environment(None),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == 0, result.stderr


def test_options_without_a_program_are_reported(tmp_path: Path) -> None:
    line = last_line(daemon(tmp_path, "control.options=kp=1"))
    assert "control.options: requires control.program" in line


def test_a_program_is_built_out_of_tree_with_pkg_config_alone(tmp_path: Path) -> None:
    flags = subprocess.run(
        ["pkg-config", "--cflags", "ecdaq"],
        env=os.environ | {"PKG_CONFIG_PATH": str(next(STAGE.glob("lib*/**/pkgconfig")))},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    source = STAGE / "share" / "ecdaq" / "examples" / "blink" / "blink.c"
    program = tmp_path / "blink.so"
    warnings = ["-std=c17", "-Wall", "-Wextra", "-Werror", "-O2"]
    shape = ["-shared", "-fPIC", "-fvisibility=hidden", *SANITIZE]
    subprocess.run(["cc", *warnings, *shape, *flags, source, "-o", program], check=True)
    symbols = subprocess.run(
        ["nm", "-D", "--defined-only", program], capture_output=True, text=True, check=True
    ).stdout
    names = [line.split()[-1] for line in symbols.splitlines()]
    assert [name for name in names if not name.startswith("__")] == ["ecdaq_program"]
    # It loads: what is wrong next is the segment, on which no slave answers.
    result = daemon(tmp_path, f"control.program={program}")
    assert "control:" not in result.stderr and result.returncode != CONFIG
