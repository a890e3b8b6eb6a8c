# SPDX-License-Identifier: MIT
"""The list of known vulnerabilities, of a made-up image and made-up data in Debian's formats."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import cves
import pytest
import sbom
from test_sbom import STATUS

TRACKER = {
    "linux": {
        "CVE-2026-1": {"releases": {"trixie": {"status": "open", "urgency": "not yet assigned"}}},
        "CVE-2026-2": {
            "releases": {
                "trixie": {"status": "resolved", "fixed_version": "6.12.110-1", "urgency": "high"}
            }
        },
        "CVE-2026-3": {
            "releases": {"trixie": {"status": "resolved", "fixed_version": "6.12.107-1"}}
        },
        "CVE-2026-4": {"releases": {"trixie": {"status": "resolved", "fixed_version": "0"}}},
        "CVE-2026-5": {"releases": {"sid": {"status": "open"}}},
    },
    "gcc-14": {
        "CVE-2026-6": {
            "releases": {"trixie": {"status": "open", "nodsa": "Minor issue", "urgency": "low"}}
        },
        "CVE-2026-7": {"releases": {"trixie": {"status": "undetermined"}}},
    },
    "not-in-the-image": {"CVE-2026-8": {"releases": {"trixie": {"status": "open"}}}},
}
SUPPORT = """\
# source
gcc-.*   limited  Only for trusted content
base-files  non-supported  13.8  2026-01-01  ended
linux-tools  limited  another
"""
SOURCES = """\
Package: linux
Binary: a
Version: 6.12.117-1
Package-List:
 a deb kernel optional

Package: base-files
Version: 13.8
"""


@pytest.fixture
def bill(tmp_path: Path) -> Path:
    (tmp_path / "var/lib/dpkg").mkdir(parents=True)
    (tmp_path / "var/lib/dpkg/status").write_text(STATUS)
    text = sbom.spdx(sbom.installed_packages(tmp_path), "image", "0.1.0", 1764547200)
    (tmp_path / "image.spdx.json").write_text(text)
    (tmp_path / "tracker.json").write_text(json.dumps(TRACKER))
    (tmp_path / "support").write_text(SUPPORT)
    (tmp_path / "lists").mkdir()
    (tmp_path / "lists/trixie_main_source_Sources").write_text(SOURCES)
    return tmp_path / "image.spdx.json"


def run(
    bill: Path, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[int, list[list[str]], str]:
    code = cves.main([str(bill), *words])
    captured = capsys.readouterr()
    return code, [line.split("\t") for line in captured.out.splitlines()], captured.err


def test_the_tracker_gives_what_is_open_and_what_a_newer_image_would_not_have(
    bill: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, lines, said = run(bill, capsys, "--tracker", str(bill.parent / "tracker.json"))
    assert code == 1
    assert lines == [
        ["gcc-14", "14.2.0-19+deb13u1", "CVE-2026-6", "open, minor", "low", ""],
        ["gcc-14", "14.2.0-19+deb13u1", "CVE-2026-7", "undetermined", "", ""],
        ["linux", "6.12.107-1", "CVE-2026-1", "open", "not yet assigned", ""],
        ["linux", "6.12.107-1", "CVE-2026-2", "fixed", "high", "6.12.110-1"],
    ]
    assert "4 known, 1 of them gone in a newer image" in said
    # What Debian does not know is said, too.
    assert "soem 1.4.0" in said and "ecdaq 0.1.0" in said


def test_without_what_a_newer_image_mends_the_exit_code_is_0(
    bill: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = json.dumps(TRACKER).replace("6.12.110-1", "6.12.107-1")
    (bill.parent / "tracker.json").write_text(text)
    code, lines, _ = run(bill, capsys, "--tracker", str(bill.parent / "tracker.json"))
    assert (code, len(lines)) == (0, 3)


def test_packages_with_limited_or_without_support_are_listed(
    bill: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, lines, _ = run(bill, capsys, "--support", str(bill.parent / "support"))
    assert code == 1
    assert [(x[0], x[3]) for x in lines] == [
        ("base-files", "support ended"),
        ("gcc-14", "limited support"),
    ]


def test_what_the_archive_has_newer_is_listed(
    bill: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, lines, _ = run(bill, capsys, "--archive", str(bill.parent / "lists"))
    assert code == 1
    assert [(x[0], x[1], x[3], x[5]) for x in lines] == [
        ("linux", "6.12.107-1", "newer", "6.12.117-1")
    ]


@pytest.mark.parametrize(
    ("option", "text", "reason"),
    [
        ("--tracker", "{}", "nothing about trixie"),
        ("--tracker", "<html>", "Expecting value"),
        ("--tracker", "[]", "list"),
        ("--archive", None, "no *_Sources in it"),
    ],
)
def test_data_of_another_kind_are_refused_in_one_line(
    bill: Path, capsys: pytest.CaptureFixture[str], option: str, text: str | None, reason: str
) -> None:
    path = bill.parent / "data"
    if text is None:
        path.mkdir()
    else:
        path.write_text(text)
    code, lines, said = run(bill, capsys, option, str(path))
    assert (code, lines, said.count("\n")) == (2, [], 1)
    assert reason in said and str(path) in said
    assert run(path, capsys, option, str(path))[0] == 2


VERSIONS = (
    *("1", "1.0", "1.0~rc1", "1.0~", "1.0-1", "1.0-1+deb13u1", "1.0-1+b1", "1.0-1~bpo1", "2"),
    *("1:0.1", "0:2", "1.0a", "1.0+dfsg-1", "1.10", "1.9", "1.0-10", "1.0-9", "6.12.107-1"),
    *("1.0-1-1", "0", "1.00", "1.0.", "257.13-1~deb13u1", "257.9-1~deb13u1"),
)


@pytest.mark.skipif(not shutil.which("dpkg"), reason="dpkg is not installed")
def test_versions_are_compared_as_dpkg_does() -> None:
    for a in VERSIONS:
        for b in VERSIONS:
            done = subprocess.run(["dpkg", "--compare-versions", a, "lt", b], check=False)
            assert (cves.compare(a, b) < 0) is (done.returncode == 0), (a, b)
