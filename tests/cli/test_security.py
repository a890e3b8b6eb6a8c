# SPDX-License-Identifier: MIT
"""ecdaq security: keys, and the errors when they cannot be made. (How they work: tests/dds.)"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from ecdaq import ECDAQ


def security(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [ECDAQ, "security", *words], cwd=folder, capture_output=True, text=True, check=False
    )


def test_a_store_is_created_filled_and_checked(tmp_path: Path) -> None:
    made = security(tmp_path, "init")
    assert made.returncode == 0, made.stderr
    assert "security/appliance: for the appliance" in made.stdout
    assert security(tmp_path, "add-subscriber", "alice").returncode == 0
    assert security(tmp_path, "add-commander", "bob", "--days", "5").returncode == 0
    for name in ("appliance", "alice", "bob"):
        looked = security(tmp_path, "check", f"security/{name}")
        assert looked.returncode == 0, looked.stderr
        assert looked.stdout.startswith(f"security/{name}: CN={name}, until 20")
    files = [p for p in (tmp_path / "security").rglob("*") if p.is_file()]
    assert len(files) == 4 + 3 * 6
    assert {p.stat().st_mode & 0o777 for p in files} == {0o600}


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ([], 2, "missing command: init, "),
        (["open"], 2, "open: unknown command"),
        (["init", "twice"], 2, "init: takes no argument"),
        (["add-commander"], 2, "add-commander: missing argument"),
        (["add-commander", "../x"], 2, "../x: invalid name: use 1 to 40 letters"),
        (["add-subscriber", "alice"], 1, "create one with ecdaq security init"),
        (["init", "--days", "40000"], 2, "--days: at most 36500"),
        (["init", "--dir", "no/where"], 1, "no/where: No such file or directory"),
        (["check", "nobody"], 1, "nobody/key.pem: No such file or directory"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_what_is_wrong_is_one_line(
    tmp_path: Path, words: list[str], code: int, message: str
) -> None:
    ended = security(tmp_path, *words)
    assert ended.returncode == code, ended.stderr
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("ecdaq: security: ")
    assert message in ended.stderr


def test_the_appliance_s_keys_are_renewed_alone(tmp_path: Path) -> None:
    assert security(tmp_path, "init").returncode == 0
    assert security(tmp_path, "add-subscriber", "alice").returncode == 0
    folder = tmp_path / "security" / "appliance"
    again = security(tmp_path, "add-appliance")
    assert again.returncode == 1
    assert "security/appliance: already exists: remove it first to renew it" in again.stderr
    before = (folder / "cert.pem").read_text()
    shutil.rmtree(folder)
    made = security(tmp_path, "add-appliance", "--days", "5")
    assert made.stdout.startswith("security/appliance: for the appliance"), made.stderr
    assert (folder / "cert.pem").read_text() != before
    for name in ("appliance", "alice"):
        assert security(tmp_path, "check", f"security/{name}").returncode == 0
        allowed = (tmp_path / "security" / name / "permissions.p7s").read_text()
        assert "<topic>ecdaq/sync0</topic>" in allowed


def test_a_store_stays_as_it_is(tmp_path: Path) -> None:
    assert security(tmp_path, "init").returncode == 0
    before = (tmp_path / "security/ca/identity_ca.key.pem").read_text()
    again = security(tmp_path, "init")
    assert again.returncode == 1
    assert "security: already contains a key store" in again.stderr
    assert (tmp_path / "security/ca/identity_ca.key.pem").read_text() == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_is_not_ours_is_a_matter_of_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    assert security(tmp_path, "init").returncode == 4
