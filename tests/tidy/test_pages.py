# SPDX-License-Identifier: MIT
"""Reference pages written by hand name all that the sources define."""

from __future__ import annotations

import re
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
