# SPDX-License-Identifier: MIT
"""The events in the page of ecdaq-web: folded, filtered, and their way to the scope."""

from __future__ import annotations

from collections.abc import Callable

from browser import SEEN, Browser
from ecdaq import ECDAQ
from recording import Bench
from web_bench import Web
from web_client import Page

SHOWN = """[...document.querySelectorAll('#event-rows tr')].filter((r) => !r.hidden)
  .map((r) => r.children[3].textContent)"""


def test_events_that_repeat_are_one_line_as_those_of_ecdaq_events(bench: Bench, web: Web) -> None:
    """38 lost frames within 3.7 s after two other events."""
    bench.produce("--cycles", "500", "--wait", "--events", "2", "--losses", "38")
    page = Page(web.port)
    page.ask(op="folds", on=True)
    lines = page.wait_for("folds", lambda m: len(m["lines"]) == 3)["lines"]
    assert lines[2]["text"] == "38 frames lost in 3.7 s, cycle 0 to 3700"
    assert (lines[2]["count"], lines[2]["kinds"]) == (38, ["frame_lost"])
    assert [line["slave"] for line in lines[:2]] == [1, 1]
    assert "slave" not in lines[2]
    shown = bench.start(ECDAQ, "--run-dir", bench.run_dir, "events")
    printed = shown.communicate(timeout=60)[0].splitlines()
    assert printed[-1].endswith(lines[2]["text"])


def test_after_10_s_what_repeats_begins_another_line(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "500", "--wait", "--losses", "150")
    page = Page(web.port)
    page.ask(op="folds", on=True)
    lines = page.wait_for("folds", lambda m: m["lines"])["lines"]
    assert [line["count"] for line in lines] == [101, 49]


def choose(browser: Browser, name: str, value: str) -> None:
    browser.value(
        f"{{ const s = document.querySelector('#{name}'); s.value = {value!r};"
        " s.dispatchEvent(new Event('input')); }"
    )


def test_events_are_filtered_by_severity_slave_and_kind_and_lead_to_the_scope(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    bench.produce("--cycles", "5000", "--wait", "--events", "2", "--losses", "38")
    browser = make_browser(web, "#events")
    count = f"{SHOWN}.length"
    browser.wait_for(f"{count} === 3")
    assert browser.value(SHOWN)[0] == "38 frames lost in 3.7 s, cycle 0 to 3700"
    choose(browser, "event-severity", "warning")
    assert browser.value(count) == 1
    choose(browser, "event-severity", "info")
    choose(browser, "event-slave", "1")
    assert browser.value(count) == 2
    choose(browser, "event-kind", "frame_lost")
    assert browser.value(count) == 0
    choose(browser, "event-slave", "")
    assert browser.value(count) == 1
    browser.value("document.querySelector('#event-all').click()")
    assert browser.value(count) == 38
    browser.value("document.querySelector('#event-rows tr:not([hidden]) button').click()")
    browser.wait_for(f"location.hash.startsWith('#scope') && {SEEN} > 0.7")
    assert "frame" in browser.text("#scope-events")
    assert browser.problems() == []
