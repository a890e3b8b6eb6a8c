# SPDX-License-Identifier: MIT
"""The page of ecdaq-web: its protocol, its modules, and itself in a browser."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from browser import SEEN, Browser
from ecdaq import FAKE, ROOT, Fake
from recording import Bench
from web_bench import Web
from web_client import Page, WebSocket, http

PAGE = ROOT / "app" / "services" / "web" / "page"
ADC = "piccolo0.adc"


def test_all_files_of_the_page_are_small_and_name_no_other_server(web: Web) -> None:
    total = 0
    for file in sorted(PAGE.iterdir()):
        status, headers, body = http(web.port, f"GET /{file.name}")
        assert (status, body) == (200, file.read_bytes())
        assert "default-src 'none'" in headers["content-security-policy"]
        total += len(body)
        text = body.decode().replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|@import|\beval\b|innerHTML|style=", text), file.name
    assert total <= 300 * 1024


def test_the_state_is_one_word_one_colour_and_one_sentence(
    fake: Callable[..., Fake], web: Web
) -> None:
    page = Page(web.port)
    off = page.wait_for("state")
    assert (off["word"], off["level"]) == ("OFF", "bad")
    assert "start it" in off["sentence"]
    daemon = fake("SPEED=1")
    state = page.wait_for("state", lambda m: m["word"] == "OP")
    assert state["level"] in ("good", "warning")
    rows = {row["name"]: row for row in state["rows"]}
    assert {"Link", "Cycles", "Samples", "Distributed clocks", "Slaves", "Recorder"} == set(rows)
    daemon.process.kill()
    daemon.process.wait()
    assert page.wait_for("state", lambda m: m["word"] != "OP")["level"] == "bad"


def test_a_lost_slave_is_red_within_a_second_of_the_page(
    fake: Callable[..., Fake], web: Web, make_browser: Callable[..., Browser]
) -> None:
    """In its own time: the state comes every 250 ms."""
    daemon = fake("SPEED=1")
    browser = make_browser(web)
    browser.wait_for("['good', 'warning'].includes(document.querySelector('#lamp').dataset.level)")
    page = Page(web.port)
    assert page.wait_for("state", lambda m: m["word"] == "OP")["level"] != "bad"
    assert daemon.process.stdin is not None
    daemon.process.stdin.write("l")
    daemon.process.stdin.flush()
    states = [page.wait_for("state") for _ in range(4)]
    assert states[-1]["level"] == "bad"
    assert "1 of 2 slaves do not answer" in states[-1]["sentence"]
    browser.wait_for("document.querySelector('#lamp').dataset.level === 'bad'")
    assert browser.problems() == []


def test_a_page_has_the_channels_their_values_and_the_events(
    fake: Callable[..., Fake], web: Web
) -> None:
    fake("SPEED=1")
    page = Page(web.port)
    table = page.wait_for("table", lambda m: m["channels"])
    names = [channel["name"] for channel in table["channels"]]
    assert ADC in names
    assert table["channels"][names.index(ADC)] == {
        "name": ADC, "unit": "V", "slave": 0, "output": False, "binary": False,
    }  # fmt: skip
    page.wait_for("state")
    assert "values" not in page.newest
    page.ask(op="values", on=True)
    values = page.wait_for("values", lambda m: m["values"][names.index(ADC)] is not None)["values"]
    assert len(values) == len(names)
    assert 0.4 < values[names.index(ADC)] < 1.6
    while not page.events:
        page.step()
    assert {"ms", "cycle", "name", "severity", "text"} == set(page.events[0])


def sine(bench: Bench, page: Page, cycles: int, *more: str) -> int:
    """A second and more of the producer's sine; the index of piccolo0.adc."""
    bench.produce("--cycles", str(cycles), "--wait", *more)
    table = page.wait_for("table", lambda m: m["channels"])
    index = [channel["name"] for channel in table["channels"]].index(ADC)
    while page.draw(channels=[index])[0]["op"] != "picture":
        pass
    return index


def test_no_sample_is_lost_between_the_pixels_of_a_picture(bench: Bench, web: Web) -> None:
    page = Page(web.port)
    index = sine(bench, page, 3000)
    head, [values], marks = page.draw(channels=[index], cycles=2000, pixels=20)
    assert (head["cycles"], head["pixels"], len(marks), set(marks)) == (2000, 20, 20, {0})
    [total] = head["sums"]
    assert total["count"] == 2000
    assert (total["min"], total["max"]) == pytest.approx((0.5, 1.5), abs=2e-3)
    assert total["mean"] == pytest.approx(1, abs=1e-3)
    assert total["rms"] == pytest.approx(math.sqrt(1 + 0.125), abs=1e-3)
    assert min(values[:20]) == pytest.approx(total["min"], abs=1e-6)
    assert max(values[20:]) == pytest.approx(total["max"], abs=1e-6)


def test_cycles_without_a_sample_are_a_gap_with_a_mark(bench: Bench, web: Web) -> None:
    page = Page(web.port)
    index = sine(bench, page, 2000, "--skip", "1500:100")
    head, [values], marks = page.draw(channels=[index], cycles=1000, pixels=1000, end=2000)
    gap = range(1500 - head["first"], 1600 - head["first"])
    for k, mark in enumerate(marks):
        assert (mark & 1, math.isnan(values[k])) == (int(k in gap), k in gap)


def test_the_trigger_is_where_the_level_is_passed(bench: Bench, web: Web) -> None:
    page = Page(web.port)
    index = sine(bench, page, 5000)
    wanted = {"channels": [index], "cycles": 1000, "pixels": 1000, "trigger": index, "before": 250}
    for edge, sign in (("rising", 1), ("falling", -1)):
        head, [values], _ = page.draw(edge=edge, level=1.2, **wanted)
        assert head["trigger"] - head["first"] == 250
        assert sign * (values[249] - 1.2) < 0 <= sign * (values[250] - 1.2)
    assert page.draw(edge="rising", level=99, **wanted)[0]["why"] == "no trigger"


def test_what_a_page_never_asks_is_ignored_and_a_flood_ends_the_connection(web: Web) -> None:
    page = Page(web.port)
    for text in ("", "{", '{"op":"set","channel":"piccolo0.led","value":1}', '{"op":"draw"}'):
        page.send(text)
    page.draw(channels=[10**6])
    page.wait_for("state")
    for text, count in (("x" * 5000, 1), ('{"op":"values","on":false}', 1000)):
        client = WebSocket(web.port, ("ecdaq.page.v1",))
        with pytest.raises(OSError):
            for _ in range(count):
                client.send(text)
            while True:
                client.recv()
    page.wait_for("state")


def test_pictures_of_a_new_session_are_of_its_own_channels(bench: Bench, web: Web) -> None:
    page = Page(web.port)
    bench.produce("--cycles", "500", "--wait").communicate("", timeout=60)
    first = page.wait_for("table", lambda m: m["channels"])
    bench.produce("--cycles", "700", "--wait", "--first", "100000")
    page.wait_for("table", lambda m: m["channels"] and m["session"] != first["session"])
    head, _, _ = page.draw(cycles=100)
    assert head["first"] > 100000


MODULE_TEST = """
import { bounds, decode, format, format_seconds, runs, ticks, value_at } from "./picture.js";
const head = JSON.stringify({ op: "picture", channels: [4], pixels: 4 }).padEnd(48);
const buffer = new ArrayBuffer(4 + 48 + 32 + 4);
const view = new DataView(buffer);
view.setUint32(0, 48, true);
new Uint8Array(buffer, 4, 48).set(new TextEncoder().encode(head));
[1, NaN, 2, 3, 1, NaN, 4, 3].forEach((v, i) => view.setFloat32(52 + 4 * i, v, true));
view.setUint8(85, 1);
const p = decode(buffer);
console.log(JSON.stringify({
  marks: [...p.marks], runs: runs(p.columns[0]), bounds: bounds(p, [0]),
  at: [0, 1, 2, 9].map((k) => value_at(p, 0, k)),
  ticks: ticks(0.42, 1.58, 6), few: ticks(-3, 1e6, 4), small: ticks(0, 1e-6, 5).length,
  texts: [format(1), format(null), format(0.1 + 0.2), format(123456789.5), format(0)],
  seconds: [format_seconds(2), format_seconds(0.0125), format_seconds(-2e-5), format_seconds(0)],
}));
"""


def test_the_arithmetic_of_a_picture(tmp_path: Path) -> None:
    """The module that has no DOM, in node."""
    if not shutil.which("node"):
        pytest.skip("no node and npm here: the page's modules need it")
    shutil.copy(PAGE / "picture.js", tmp_path)
    (tmp_path / "package.json").write_text('{"type":"module"}')
    (tmp_path / "test.js").write_text(MODULE_TEST)
    done = subprocess.run(
        ["node", "test.js"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    got = json.loads(done.stdout)
    assert got["marks"] == [0, 1, 0, 0]
    assert got["runs"] == [[0, 1], [2, 4]]
    assert got["bounds"] == {"low": pytest.approx(0.76), "high": pytest.approx(4.24)}
    assert got["at"] == [1, None, 3, None]
    assert got["ticks"] == pytest.approx([0.6, 0.8, 1.0, 1.2, 1.4])
    assert got["few"] == [0, 500000, 1000000]
    assert got["small"] == 6
    assert got["texts"] == ["1", "\u2013", "0.3", "1.23457e+8", "0"]
    assert got["seconds"] == ["2 s", "12.5 ms", "-20 µs", "0 s"]


@pytest.mark.parametrize("slaves", [2, 64])
def test_each_view_shows_the_bus_in_a_browser(
    fake: Callable[..., Fake], web: Web, make_browser: Callable[..., Browser], slaves: int
) -> None:
    program = FAKE.with_name(f"{FAKE.name}_64") if slaves == 64 else FAKE
    daemon = fake("SPEED=1", program=program)
    browser = make_browser(web)
    browser.wait_for("document.querySelector('#word').textContent === 'OP'")
    assert "slave" in browser.text("#rows").lower()
    browser.value("location.hash = '#bus'")
    browser.wait_for(f"document.querySelectorAll('#bus-rows tr').length === {slaves}")
    assert f"{slaves} slaves found" in browser.text("#bus-note")
    cells = "[...document.querySelectorAll('#bus-rows tr:nth-child(2) td')].map(c => c.textContent)"
    _, name, device, state, at, cable, errors, links = browser.value(cells)
    assert (name.strip("\u2502\u251c "), state, at) == ("piccolo1", "OP", "0:1")
    assert device.startswith("FB1111")
    assert (cable, errors, links) == ("310 ns", "3", "0")
    browser.value("document.querySelector('#bus-rows tr:nth-child(2) button').click()")
    browser.wait_for("!document.querySelector('#bus-slave').hidden")
    assert browser.text("#bus-slave-name") == "1 piccolo1: OP"
    assert "0x04570862" in browser.text("#bus-identity")
    assert "SyncManager watchdog" in browser.text("#bus-facts")
    assert browser.value("location.hash") == "#bus?s=1"
    browser.value("location.hash = '#channels'")
    browser.wait_for("document.querySelector('#channel-rows').textContent.includes('piccolo0.adc')")
    browser.wait_for("/[01]\\.\\d+/.test(document.querySelector('#channel-rows').textContent)")
    rows = "document.querySelectorAll('#channel-rows tr').length"
    assert browser.value(rows) == 6 * slaves
    browser.value("location.hash = '#events'")
    browser.wait_for("document.querySelector('#event-rows tr')")
    browser.value(f"location.hash = '#scope?c=piccolo{slaves - 1}.adc&w=2'")
    browser.wait_for(f"{SEEN} > 0.7")
    assert browser.value("document.querySelector('#scope-add').options.length") > 6 * slaves
    daemon.process.kill()
    daemon.process.wait()
    browser.wait_for("document.querySelector('#lamp').dataset.level === 'bad'", 10)
    assert browser.problems() == []


def test_recordings_are_listed_and_downloaded_in_a_browser(
    bench: Bench, make_web: Callable[..., Web], make_browser: Callable[..., Browser]
) -> None:
    bench.produce("--cycles", "500", "--wait", "--skip", "100:5").communicate("", timeout=60)
    bench.record_all()
    [path] = bench.files()
    web = make_web(record_dir=str(bench.folder))
    browser = make_browser(web, "#recordings")
    cells = "[...document.querySelectorAll('#recording-rows td')].map((c) => c.textContent)"
    browser.wait_for(f"{cells}[5] === '5 cycles'")
    name, start, length, size, state, _, links = browser.value(cells)
    assert (name, length, state, links) == (path.name, "0.5 s", "finished", "MCAP CSV")
    assert start.startswith("20") and size.endswith("B")
    for number, end in ((0, ".mcap"), (1, ".csv")):
        anchor = f"document.querySelectorAll('#recording-rows a')[{number}].href"
        size = browser.value(f"fetch({anchor}).then((r) => r.blob()).then((b) => b.size)")
        assert browser.value(anchor).endswith(path.stem + end)
        assert size == (path.stat().st_size if end == ".mcap" else exported_bytes(bench, path))
    assert browser.problems() == []


def exported_bytes(bench: Bench, path: Path) -> int:
    return len(bench.log("export", path).stdout)


@pytest.mark.parametrize("dark", [False, True])
def test_the_scope_measures_the_sine_in_a_browser(
    bench: Bench, web: Web, make_browser: Callable[..., Browser], dark: bool
) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    place = f"#scope?c={ADC}&w=2&edge=rising&t={ADC}&l=1&m=normal"
    browser = make_browser(web, place, dark=dark)
    browser.wait_for(
        "document.querySelector('#scope-note').textContent.includes('trigger at cycle')"
    )
    assert browser.wait_for(SEEN) > 0.7
    browser.value("document.querySelector('#scope-cursors').click()")
    browser.wait_for("document.querySelector('#scope-note').textContent.startsWith('paused')")
    # The cursors are at a quarter and at three quarters: one period of 1 Hz apart.
    assert browser.text("#scope-cursor-text") == "B \u2212 A: 1 s, 1 Hz"
    cells = (
        "[...document.querySelectorAll('#scope-rows tr:first-child td')].map(c => c.textContent)"
    )
    least, largest, mean, rms, hertz, a, b, step = map(float, browser.value(cells)[2:10])
    assert hertz == pytest.approx(1, abs=5e-4)
    assert (least, largest, mean) == pytest.approx((0.5, 1.5, 1), abs=3e-3)
    assert rms == pytest.approx(math.sqrt(1.125), abs=3e-3)
    assert (a, b) == pytest.approx((1, 1), abs=0.02)
    assert step == pytest.approx(0, abs=0.02)
    browser.value("document.querySelector('#scope-canvas').focus()")
    for key in ("ArrowLeft", "+", "l"):
        browser.tell("Input.dispatchKeyEvent", type="keyDown", key=key)
    browser.wait_for(
        "document.querySelector('#scope-pause').getAttribute('aria-pressed') === 'false'"
    )
    assert "w=1&" in browser.wait_for("location.hash.includes('w=1&') && location.hash")
    assert browser.problems() == []


def test_what_the_security_policy_forbids_is_a_problem(
    web: Web, make_browser: Callable[..., Browser]
) -> None:
    """So that the other tests would find it."""
    browser = make_browser(web)
    browser.wait_for("document.querySelector('#word').textContent === 'OFF'")
    assert browser.problems() == []
    browser.value("document.body.setAttribute('style', 'color: red')")
    assert "Content Security Policy" in str(browser.problems())
    browser.value("void setTimeout(() => { throw new Error('of a test') })")
    browser.wait_for("new Promise((done) => setTimeout(() => done(true), 50))")
    assert "of a test" in str(browser.problems())


def test_the_page_comes_back_after_a_restart_of_the_server_and_a_reload(
    bench: Bench, make_web: Callable[..., Web], make_browser: Callable[..., Browser]
) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    web = make_web()
    browser = make_browser(web, f"#scope?c={ADC}&w=2")
    browser.wait_for(f"{SEEN} > 0.7")
    lamp = "document.querySelector('#lamp').textContent"
    web.stop()
    browser.wait_for(f"{lamp} === 'no connection'")
    make_web(web_port=str(web.port))
    browser.wait_for(f"{lamp} !== 'no connection'")
    browser.value("document.querySelector('#scope-canvas').width = 2")  # cleared
    browser.wait_for(f"{SEEN} > 0.7")
    browser.seen.clear()  # that the server was away
    browser.tell("Page.reload")
    browser.wait_for("document.readyState === 'complete'")
    browser.wait_for(f"{SEEN} > 0.7")
    assert ADC in browser.text("#scope-rows")
    assert browser.problems() == []
