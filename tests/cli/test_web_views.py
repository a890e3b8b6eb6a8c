# SPDX-License-Identifier: MIT
"""Each view of the page of ecdaq-web: light and dark, accessible, small; and its picture."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import npm
import pytest
from browser import SEEN, Browser
from ecdaq import ROOT, Fake
from recording import Bench
from web_bench import Web

RECORDING = Path(__file__).with_name("recordings") / "bad_slaves_in_one_word.mcap"
AXE = Path(__file__).with_name("axe")
ADC = "piccolo0.adc"
DOC = ROOT / "app" / "doc"
CONFIG = """\
bus: {interface: ecat0}
cycle: {cpu: 3, priority: 90}
record: {rotate_period: 10min, budget: 20GiB}
"""
VIEWS = {
    "state": (
        "state",
        "document.querySelectorAll('#rows tr').length > 3"
        " && !!document.querySelector('#doctor-rows tr')",
    ),
    "bus": ("bus?s=1", "document.querySelectorAll('#bus-ports tr, #bus-rows tr').length === 6"),
    "channels": ("channels", "/\\d/.test(document.querySelector('#channel-rows').textContent)"),
    "events": ("events", "!!document.querySelector('#event-rows tr')"),
    "recordings": ("recordings", "!!document.querySelector('#recording-rows tr')"),
    "scope": (
        f"scope?c={ADC}&w=2&edge=rising&t={ADC}&l=1&a=fft",
        f"{SEEN} > 0.7 && document.querySelector('#analysis-note').textContent !== ''",
    ),
    "config": ("config", "!!document.querySelector('#config-rows tr')"),
}


def test_each_view_has_its_pictures_in_the_how_to() -> None:
    text = (DOC / "how-to" / "look-at-the-page.md").read_text()
    for name in VIEWS:
        for scheme in ("light", "dark"):
            file = DOC / "pictures" / f"{name}-{scheme}.png"
            assert f"../pictures/{file.name}" in text
            assert file.read_bytes().startswith(b"\x89PNG")
            assert file.stat().st_size < 60_000


def open_all(
    fake: Callable[..., Fake],
    bench: Bench,
    make_web: Callable[..., Web],
    make_browser: Callable[..., Browser],
    **arguments: Any,
) -> Browser:
    """With something to see in every view."""
    fake("SPEED=1")
    shutil.copy(RECORDING, bench.folder / "ecdaq-20260102T030405Z-0a-000001.mcap")
    config = bench.folder.parent / "ecdaq.yaml"
    config.write_text(CONFIG)
    return make_browser(make_web(config, record_dir=str(bench.folder)), **arguments)


def show(browser: Browser, name: str) -> None:
    place, is_there = VIEWS[name]
    browser.value(f"location.hash = '#{place}'")
    browser.wait_for(is_there)


def make_small(file: Path) -> None:
    """A palette of 64 colours is enough for text and lines."""
    try:
        from PIL import Image
    except ImportError:
        return
    with Image.open(file) as image:
        few = image.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    few.save(file, optimize=True)


@pytest.mark.parametrize("dark", [False, True])
def test_each_view_is_light_or_dark_as_the_browser_is(
    fake: Callable[..., Fake],
    bench: Bench,
    make_web: Callable[..., Web],
    make_browser: Callable[..., Browser],
    tmp_path: Path,
    dark: bool,
) -> None:
    """ECDAQ_PICTURES names a folder in which the pictures are kept."""
    folder = Path(os.environ.get("ECDAQ_PICTURES", tmp_path))
    browser = open_all(fake, bench, make_web, make_browser, dark=dark)
    for name in VIEWS:
        show(browser, name)
        file = folder / f"{name}-{'dark' if dark else 'light'}.png"
        browser.picture(file)
        make_small(file)
        assert file.read_bytes().startswith(b"\x89PNG")
        colour = browser.value("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, re.findall(r"\d+", colour))) < 3 * 64) == dark
    assert browser.problems() == []


FOUND = """axe.run(document, { resultTypes: ['violations'] }).then((r) => r.violations
  .filter((v) => ['serious', 'critical'].includes(v.impact))
  .map((v) => [v.id, v.nodes.map((n) => n.html).slice(0, 3)]))"""


@pytest.mark.parametrize("dark", [False, True])
def test_no_view_has_a_serious_problem_of_accessibility(
    fake: Callable[..., Fake],
    bench: Bench,
    make_web: Callable[..., Web],
    make_browser: Callable[..., Browser],
    dark: bool,
) -> None:
    axe = npm.install(AXE, "axe-core") / "node_modules" / "axe-core" / "axe.min.js"
    browser = open_all(fake, bench, make_web, make_browser, dark=dark)
    browser.value(axe.read_text() + "; void 0")
    for name in VIEWS:
        show(browser, name)
        assert browser.value(FOUND) == [], name
    # So that it would be found.
    browser.value("document.querySelector('main').append(document.createElement('select'))")
    assert [problem for problem, _ in browser.value(FOUND)] == ["select-name"]


def test_the_page_loads_little_and_has_the_state_in_its_first_messages(
    fake: Callable[..., Fake], web: Web, make_browser: Callable[..., Browser]
) -> None:
    """By counts: a loaded machine is slow, but sends no more."""
    fake("SPEED=1")
    browser = make_browser(web)
    browser.wait_for("document.querySelector('#word').textContent === 'OP'")
    browser.tell("Network.enable")
    browser.tell("Network.setCacheDisabled", cacheDisabled=True)
    browser.seen.clear()
    browser.tell("Page.reload")
    browser.wait_for("document.readyState === 'complete'")
    browser.wait_for("document.querySelector('#word')?.textContent === 'OP'")
    messages = browser.seen
    requested = [
        m["params"]["request"]["url"]
        for m in messages
        if m["method"] == "Network.requestWillBeSent"
    ]
    assert 5 < len(requested) <= 30
    assert all(url.startswith(f"http://127.0.0.1:{web.port}/") for url in requested)
    loaded = [m["params"] for m in messages if m["method"] == "Network.loadingFinished"]
    assert 20_000 < sum(p["encodedDataLength"] for p in loaded) <= 300 * 1024
    frames = [m["params"] for m in messages if m["method"] == "Network.webSocketFrameReceived"]
    first = [json.loads(f["response"]["payloadData"])["op"] for f in frames[:2]]
    assert first == ["table", "state"]
