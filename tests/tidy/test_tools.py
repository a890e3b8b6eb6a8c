# SPDX-License-Identifier: MIT
"""Formatters and linters find nothing, and would find something if there were something."""

from __future__ import annotations

import os
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import tools
from project import ROOT

BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))


def expect_silence(command: list[str]) -> None:
    result = tools.run(command)
    assert result.returncode == 0, f"\n{result.stdout}{result.stderr}"


def test_c_is_formatted() -> None:
    result = tools.run(["clang-format", "--dry-run", "--Werror", *tools.c_files()])
    unformatted = sorted(set(re.findall(r"^([^:\n]+):\d+:\d+: error", result.stderr, re.MULTILINE)))
    assert result.returncode == 0, "./build.sh lint --fix formats:\n" + "\n".join(unformatted)


def test_python_is_formatted() -> None:
    expect_silence(["ruff", "format", "--check", "--no-cache", *tools.python_files()])


def test_python_is_clean() -> None:
    expect_silence(["ruff", "check", "--no-cache", *tools.python_files()])


def test_shell_is_clean() -> None:
    assert "build.sh" in tools.shell_files()
    expect_silence(["shellcheck", "--external-sources", *tools.shell_files()])


@pytest.fixture(scope="module")
def clang_tidy_findings() -> dict[str, str]:
    """clang-tidy over every file that is built, on all cores."""
    commands = tools.compile_commands(BUILD)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(lambda name: tools.clang_tidy(name, commands[name], BUILD), commands)
        return dict(zip(commands, found, strict=True))


def test_clang_tidy_finds_nothing(clang_tidy_findings: dict[str, str]) -> None:
    assert clang_tidy_findings, f"{BUILD}/compile_commands.json names no file of the project"
    findings = "\n".join(text for text in clang_tidy_findings.values() if text)
    assert not findings, f"\n{findings}"


@pytest.mark.parametrize(
    ("name", "text", "command"),
    [
        ("bad.c", "int  f(void) {return 1;}\n", ["clang-format", "--dry-run", "--Werror"]),
        ("bad.py", "x = (1,\n2)\n", ["ruff", "format", "--check", "--no-cache"]),
        ("bad.py", "import os\n", ["ruff", "check", "--no-cache"]),
        ("bad.py", "def f(a):\n    return a\n", ["ruff", "check", "--no-cache"]),
        ("bad.sh", "#!/bin/sh\nrm $1\n", ["shellcheck"]),
        ("bad.c", "int f(int *p)\n{\n\tif (!p)\n\t\treturn *p;\n\treturn 0;\n}\n", ["clang-tidy"]),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_a_tool_finds_the_fault(tmp_path: Path, name: str, text: str, command: list[str]) -> None:
    for config in (".clang-format", ".clang-tidy", "ruff.toml"):
        (tmp_path / config).write_bytes((ROOT / config).read_bytes())
    (tmp_path / name).write_text(text)
    tail = ["--", "-std=c17"] if command[0] == "clang-tidy" else []
    result = tools.run([*command, name, *tail], cwd=tmp_path)
    assert result.returncode != 0, result.stdout + result.stderr
    assert name in result.stdout + result.stderr


NINJA = """
rule cc
  command = gcc -MD -MF $out.d -o $out -c $in
  depfile = $out.d
  deps = gcc
build a.o: cc ../a.c
"""


def build_sample(root: Path, monkeypatch: pytest.MonkeyPatch) -> str | None:
    """The key of a.c, which includes a.h, in the tree @root after a build."""
    monkeypatch.setattr(tools, "ROOT", root)
    (root / "build").mkdir(exist_ok=True)
    (root / "build" / "build.ninja").write_text(NINJA)
    (root / "a.c").write_text('#include "a.h"\nint a = A;\n')
    tools.run(["ninja", "-C", str(root / "build")])
    return sample_key(root)


def sample_key(root: Path) -> str | None:
    tools.compiled_from.cache_clear()
    tools.digest.cache_clear()
    command = ["gcc", "-o", "a.o", "-c", str(root / "a.c")]
    return tools.tidy_key("a.c", command, root / "build")


def test_a_verdict_is_remembered_for_the_text_of_a_file_and_its_headers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for root in (here, there):
        root.mkdir()
        (root / "a.h").write_text("#define A 1\n")
    key = build_sample(here, monkeypatch)
    assert key
    (here / "a.h").write_text("#define A 2\n")
    assert sample_key(here) is None, "changed since the build, which may know too few headers"
    other = build_sample(here, monkeypatch)
    assert other not in (None, key)
    assert build_sample(there, monkeypatch) == key, "wherever the tree is"
