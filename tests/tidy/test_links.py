# SPDX-License-Identifier: MIT
"""Every relative link and every path of the tree that a page names exists."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
PATH = re.compile(r"`((?:app|tests|layers|recipes|kernel-config|LICENSES)/[\w./-]+)`")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def pages() -> list[str]:
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return [name for name in listed.stdout.splitlines() if (ROOT / name).exists()]


def anchors(page: Path) -> set[str]:
    """The anchors of its headings, as GitHub and GitLab make them."""
    text = FENCE.sub("", page.read_text())
    headings = re.findall(r"^#+ +(.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def problems(page: Path, text: str) -> list[str]:
    found = []
    plain = FENCE.sub("", text)
    for target in LINK.findall(plain):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        to = page.parent / name if name else page
        if not to.exists():
            found.append(f"link to {target}: no such file")
        elif anchor and to.suffix == ".md" and anchor not in anchors(to):
            found.append(f"link to {target}: no such heading")
    # Downloaded sources are not in a fresh clone; NNNN and NAME are placeholders.
    found += [
        f"path {name}: no such file"
        for name in PATH.findall(plain)
        if not (ROOT / name).exists() and not re.search(r"third_party|NNNN|NAME", name)
    ]
    return found


def test_links_and_paths_are_recognized() -> None:
    text = "".join((ROOT / name).read_text() for name in pages())
    assert len(LINK.findall(text)) > 150
    assert len(PATH.findall(text)) > 60


@pytest.mark.parametrize("name", pages())
def test_links_and_paths_of_a_page_exist(name: str) -> None:
    if name == "CHANGELOG.md":
        return  # it names files of earlier versions
    assert not problems(ROOT / name, (ROOT / name).read_text())


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[a](nowhere.md)", "link to nowhere.md: no such file"),
        ("[a](README.md#nothing-of-that-name)", "no such heading"),
        ("see `app/nothing/here.c`", "path app/nothing/here.c"),
        ("[a](README.md) `app/core` [b](https://example.org/)", ""),
    ],
)
def test_a_broken_link_is_found(text: str, problem: str) -> None:
    found = problems(ROOT / "README.md", text)
    assert len(found) == (1 if problem else 0)
    assert problem in "".join(found)
