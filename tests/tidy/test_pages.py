# SPDX-License-Identifier: MIT
"""Reference pages written by hand name all that the sources define."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOC = ROOT / "app/doc"


def test_events_page_lists_every_event_with_its_severity() -> None:
    source = (ROOT / "app/core/base/event.c").read_text()
    page = (DOC / "reference/events.md").read_text()
    defined = re.findall(r'\[EVENT_\w+\] = \{ "(\w+)", EVENT_(\w+) \}', source)
    listed = re.findall(r"^\| `(\w+)` \| (info|notice|warning|error) \|", page, re.MULTILINE)
    assert len(defined) > 40
    assert listed == [(name, level.lower()) for name, level in defined if name != "none"]


def test_events_page_lists_every_sample_flag() -> None:
    source = (ROOT / "app/core/base/sample.h").read_text()
    page = (DOC / "reference/events.md").read_text()
    defined = re.findall(r"\b(SAMPLE_[A-Z_]+) = 1u <<", source)
    assert len(defined) >= 9
    assert re.findall(r"^\| `(SAMPLE_\w+)` \|", page, re.MULTILINE) == defined


def test_index_of_decisions_has_every_title() -> None:
    folder = DOC / "explanation/adr"
    titles = {
        path.name: path.read_text().splitlines()[0].removeprefix("# ")
        for path in sorted(folder.glob("[0-9]*.md"))
    }
    index = re.findall(r"^- \[(.*)\]\((.*)\)$", (folder / "README.md").read_text(), re.MULTILINE)
    assert index == [(title, name) for name, title in titles.items()]


def test_every_page_is_reached_from_the_index() -> None:
    reached: set[Path] = set()
    waiting = [DOC / "README.md"]
    while waiting:
        page = waiting.pop()
        if page in reached or not page.is_file():
            continue
        reached.add(page)
        for link in re.findall(r"\]\(([^)#\s]+\.md)(?:#[^)]*)?\)", page.read_text()):
            waiting.append((page.parent / link).resolve())
    results = set((DOC / "results").glob("*.md"))  # written by the command that measures
    assert set(DOC.rglob("*.md")) - reached - results == set()


def test_tests_named_by_the_pitfalls_page_exist() -> None:
    page = (DOC / "reference/pitfalls.md").read_text()
    sources = (ROOT / "tests").rglob("*.c")
    defined = {
        f"{suite}.{name}"
        for path in sources
        for suite, name in re.findall(r"^TEST\((\w+), (\w+)\)", path.read_text(), re.MULTILINE)
    }
    named = [name for name in re.findall(r"`(\w+\.\w+)`", page) if not name.startswith("bus.")]
    assert len(named) > 30
    assert [name for name in named if name not in defined and name != "cycle.period"] == []


def tracked() -> list[Path]:
    listing = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [ROOT / name for name in listing.stdout.split("\0") if name]


def anchors(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_every_relative_link_leads_to_a_file_and_a_heading() -> None:
    broken: list[str] = []
    count = 0
    for page in (path for path in tracked() if path.suffix == ".md"):
        for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
            if re.match(r"[a-z]+:", link):
                continue
            name, _, anchor = link.partition("#")
            target = (page.parent / name).resolve() if name else page
            count += 1
            if not target.exists() or (
                anchor and target.suffix == ".md" and anchor not in anchors(target)
            ):
                broken.append(f"{page.relative_to(ROOT)}: {link}")
    assert count > 150
    assert broken == []


def test_every_path_of_the_tree_that_a_page_names_exists() -> None:
    missing: list[str] = []
    count = 0
    for page in (path for path in tracked() if path.suffix == ".md"):
        for name in re.findall(r"`((?:app|tests|recipes|layers)/[\w./-]+)`", page.read_text()):
            is_placeholder = re.search(r"[A-Z]{4}", name)  # NNNN, MODULE
            is_fetched = name in ("app/third_party/soem/", "app/third_party/libgpiod/")
            if is_placeholder or is_fetched:
                continue
            count += 1
            if not (ROOT / name).exists():
                missing.append(f"{page.relative_to(ROOT)}: {name}")
    assert count > 60
    assert missing == []
