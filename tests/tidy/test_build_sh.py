# SPDX-License-Identifier: MIT
"""build.sh documents itself, and reports a wrong call in one line."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest
from project import ROOT

VERBS = [
    "run",
    "test",
    "build",
    "sim",
    "fuzz",
    "lint",
    "measure",
    "bench",
    "clean",
    "deb",
    "image",
    "boot",
    "help",
]


def build_sh(*arguments: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [ROOT / "build.sh", *arguments],
        env=os.environ | env,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_is_explained(verb: str) -> None:
    assert re.search(rf"^  {verb} ", build_sh("help").stdout, re.MULTILINE)
    explained = build_sh("help", verb)
    assert explained.returncode == 0
    assert "usage: ./build.sh" in explained.stdout


@pytest.mark.parametrize("verb", ["run", "test", "lint", "clean"])
def test_every_option_is_documented(verb: str) -> None:
    text = (ROOT / "build.sh").read_text()
    if verb == "run":
        body = (ROOT / "app/tools/run-segment.sh").read_text()
        body = body[body.index("parse_options()") : body.index("check_options()")]
        known = set(re.findall(r"(--[a-z-]+)(?= \||\))", body)) - {"--check", "--inside", "--help"}
    elif verb == "test":
        body = (ROOT / "app/tools/run_tests.py").read_text()
        known = set(re.findall(r'add_argument\(\s*"(--[a-z-]+)"', body)) - {"--check"}
    else:
        body = text[text.index(f"do_{verb}()") :]
        known = set(re.findall(r"^\t.*(--[a-z-]+)\)", body[: body.index("\n}")], re.MULTILINE))
    assert known
    explained = build_sh("help", verb).stdout
    assert not [option for option in known if f" {option} " not in explained]


def test_every_variable_is_documented() -> None:
    scripts = ["build.sh", "app/tools/setup.sh", "app/tools/run-segment.sh"]
    read = {
        name
        for script in scripts
        for name in re.findall(r"\$\{(ECDAQ_\w+|PYTHON|XDG_\w+):-", (ROOT / script).read_text())
    }
    explained = "".join(build_sh("help", verb).stdout for verb in ("help", "test", "run"))
    assert read
    assert not [name for name in read if name not in explained]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (["fly"], "no verb 'fly'"),
        (["help", "fly"], "no verb 'fly'"),
        (["run", "--seconds", "0"], "--seconds: '0'"),
        (["run", "--seconds", "1m"], "--seconds: '1m'"),
        (["run", "--seconds"], "--seconds needs a value"),
        (["run", "--slaves", "513"], "--slaves: 513 is not 1 to 512"),
        (["run", "--slaves", "0"], "--slaves: 0 is not 1 to 512"),
        (["run", "--slaves", "ek1100", "--sii", "/nowhere"], "/nowhere: no such directory"),
        (["run", "--config", "/nowhere.yaml"], "/nowhere.yaml: cannot be read"),
        (["run", "--fast"], "unknown option '--fast'"),
        (["test", "units"], "no group 'units'"),
        (["build", "quick"], "no flavour 'quick'"),
        (["measure", "speed"], "no subject 'speed'"),
        (["bench"], "name what to measure: peers sim setup cycle record dds"),
        (["bench", "fly"], "no subject 'fly'; there are: peers sim setup cycle record dds"),
        (["bench", "dds", "--slaves", "2"], "bench: dds has no options"),
        (["bench", "setup", "--slaves", "2"], "--slaves: not an option of setup"),
        (["bench", "sim", "--rounds", "2"], "--rounds: not an option of sim"),
        (["bench", "peers", "--seeds", "2"], "--seeds: not an option of peers"),
        (["bench", "sim", "--before", "/no"], "--before: /no has no tests/cost/cost_virtual"),
        (["bench", "peers", "--slaves", "2,x"], "--slaves: 'x' is not a number from 1 to 128"),
        (["bench", "peers", "--slaves", "129"], "--slaves: '129' is not a number from 1 to 128"),
        (["bench", "peers", "--cycles", "9"], "--cycles: '9' is not a number from 100 to 50000"),
        (["bench", "peers", "--rounds", "0"], "--rounds: '0' is not a number from 1 to 100"),
        (["bench", "peers", "--interface", "no0"], "'no0': no such network interface"),
        (["bench", "peers", "--interface", "lo", "--slaves", "2"], "exclude each other"),
        (["bench", "peers", "--fast"], "unrecognized arguments: --fast"),
        (["lint", "--all"], "unknown option '--all'"),
        (["clean", "everything"], "unknown option 'everything'"),
        (["fuzz", "nothing"], "no target 'nothing'"),
        (["fuzz", "canary", "long"], "'long' is not a number"),
        (["image", "--machine", "pc"], "'pc'; there are: ecdaq-qemuarm64 ecdaq-raspberrypi4-64"),
        (["image", "--jobs", "0"], "'0' is not a number of tasks"),
        (["image", "--fast"], "unknown option '--fast'"),
        (["image", "--refresh", "--plan"], "--refresh and --plan exclude each other"),
        (["boot", "--ssh-port", "x"], "'x' is not a port"),
        (["boot", "--fast"], "unknown option '--fast'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_a_wrong_call_gets_one_line(call: list[str], message: str) -> None:
    result = build_sh(*call)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1, result.stderr
    assert message in result.stderr


def test_a_wrong_call_is_reported_before_anything_is_installed_or_built(tmp_path: Path) -> None:
    # With an empty cache the Python environment would be made.
    result = build_sh("test", "units", XDG_CACHE_HOME=str(tmp_path))
    assert result.returncode == 2
    assert "there are: unit tidy" in result.stderr
    assert not list(tmp_path.iterdir())


def tools_without(folder: Path, *names: str) -> Path:
    """A folder for PATH with what this machine has, but for @names."""
    tools = folder / "bin"
    tools.mkdir()
    for place in ("/usr/bin", "/bin"):
        for tool in Path(place).iterdir():
            if tool.name not in names and not (tools / tool.name).is_symlink():
                (tools / tool.name).symlink_to(tool)
    return tools


def test_the_package_lists_are_read_once_and_all_is_installed_at_once(tmp_path: Path) -> None:
    if os.geteuid() != 0:
        pytest.skip("not permitted: packages are installed as root")
    tools = tools_without(tmp_path, "ninja", "idlc", "apt-get")
    (tools / "apt-get").write_text(f'#!/bin/sh\necho "$*" >> {tmp_path}/calls\n')
    (tools / "apt-get").chmod(0o755)
    release = tmp_path / "os-release"
    release.write_text("ID=debian\nVERSION_ID=12\n")
    result = build_sh("build", PATH=str(tools), ECDAQ_OS_RELEASE=str(release))
    assert result.returncode == 1
    assert "still not found after installing" in result.stderr
    calls = (tmp_path / "calls").read_text().splitlines()
    assert [call.split()[0] for call in calls[:2]] == ["update", "install"]
    assert {"ninja-build", "cyclonedds-tools"} <= set(calls[1].split())
    assert sum(call.startswith("update") for call in calls) == 1


def test_run_installs_nothing_that_only_other_programs_need() -> None:
    text = (ROOT / "build.sh").read_text()
    for function in ("prepare_programs", "do_run", "do_sim"):
        body = text[text.index(f"{function}()\n") :]
        assert not re.search(r"stream|uplink|prepare_build|need_venv", body[: body.index("\n}")])


def test_where_nothing_can_be_installed_what_is_missing_is_listed_with_its_reason(
    tmp_path: Path,
) -> None:
    tools = tools_without(tmp_path, "ninja", "patch")
    release = tmp_path / "os-release"
    release.write_text("ID=other\n")
    result = build_sh("build", PATH=str(tools), ECDAQ_OS_RELEASE=str(release))
    assert result.returncode == 1
    assert "not Debian 12 or 13" in result.stderr
    assert re.search(r"^  ninja-build +runs the build$", result.stderr, re.MULTILINE)
    assert re.search(r"^  patch +applies our patches", result.stderr, re.MULTILINE)
    assert "cmake " not in result.stderr
