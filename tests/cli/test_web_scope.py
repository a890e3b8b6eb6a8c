# SPDX-License-Identifier: MIT
"""The scope of ecdaq-web: triggers by its protocol, analysis in node, the rest in a browser."""

from __future__ import annotations

import base64
import json
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from browser import SEEN, Browser
from ecdaq import ROOT
from recording import Bench
from web_bench import Web
from web_client import Page

PAGE = ROOT / "app" / "services" / "web" / "page"
ADC = "piccolo0.adc"
ADC1 = "piccolo1.adc"


def index_of(page: Page, name: str = ADC) -> int:
    table = page.wait_for("table", lambda m: m["channels"])
    return [channel["name"] for channel in table["channels"]].index(name)


def wait_for_samples(page: Page, **request: Any) -> None:
    while page.draw(**request)[0]["op"] != "picture":
        pass


def trigger_of(page: Page, **request: Any) -> int | None:
    wanted = {"cycles": 100, "pixels": 100, "before": 10} | request
    return page.draw(**wanted)[0].get("trigger")


def test_a_trigger_is_a_level_a_window_a_bad_sample_a_lost_frame_or_an_event(
    bench: Bench, web: Web
) -> None:
    """Of a sine of 1 Hz, 1 V +- 0.5 V; 1 V is no step of the converter, it is passed at 2001."""
    options = ("--bad", "700", "--lost", "900", "--events", "20")
    bench.produce("--cycles", "2500", "--wait", *options)
    page = Page(web.port)
    adc, other = index_of(page), 3
    wait_for_samples(page, end=2000)
    last = 2500 - 90  # the picture ends 90 cycles after its trigger
    assert (
        trigger_of(page, edge="rising", trigger=adc, level=1) == 2001
    )  # 1.0 V is no step of the converter
    assert trigger_of(page, edge="above", trigger=adc, level=1) == last
    assert trigger_of(page, edge="below", trigger=adc, level=0.75) == pytest.approx(1916, abs=2)
    inside = {"trigger": adc, "level": 1.25, "level2": 0.75}
    assert trigger_of(page, edge="enters", **inside) == pytest.approx(1917, abs=2)
    assert trigger_of(page, edge="leaves", **inside) == pytest.approx(2084, abs=2)
    assert trigger_of(page, edge="bad", trigger=other) == 2100
    assert trigger_of(page, edge="bad", trigger=adc) is None
    assert trigger_of(page, edge="lost") == 1800
    while len(page.events) < 20:
        page.step()
    severity = page.events[0]["severity"]
    assert trigger_of(page, edge="event", severity=severity) == 1900
    assert trigger_of(page, edge="event", severity="error") is None


def test_within_the_hold_off_the_scope_keeps_the_trigger_that_it_shows(
    bench: Bench, web: Web
) -> None:
    bench.produce("--cycles", "4500", "--wait")
    page = Page(web.port)
    wanted = {"edge": "rising", "trigger": index_of(page), "level": 1, "cycles": 2400, "before": 0}
    wait_for_samples(page)
    assert trigger_of(page, **wanted, end=4500) == 2001
    assert trigger_of(page, **wanted, end=4500, last=1001, hold=500) == 2001
    assert trigger_of(page, **wanted, end=4500, last=1001, hold=1500) == 1001


def test_the_frequency_of_a_sine_is_measured_across_no_gap(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "8000", "--wait", "--skip", "2300:20")
    page = Page(web.port)
    index = index_of(page)
    wait_for_samples(page, end=7000)
    head, _, _ = page.draw(channels=[index], cycles=7000, end=7000)
    assert head["sums"][0]["period"] == pytest.approx(1000, abs=0.5)
    head, _, _ = page.draw(channels=[index], cycles=900, end=7000)
    assert head["sums"][0]["period"] is None


SPECTRUM_TEST = """
import { amplitudes, peak_of, usable, WINDOWS } from "./spectrum.js";
import { csv } from "./save.js";
const found = {};
for (const window of Object.keys(WINDOWS)) {
  for (const line of [40, 40.5]) {
    const samples = Float64Array.from({ length: 1024 },
      (_, n) => 3 + 0.5 * Math.sin((2 * Math.PI * line * n) / 1024 + 0.3));
    const lines = amplitudes(samples, window);
    found[`${window} ${line}`] = [peak_of(lines), lines[peak_of(lines)], lines[0], lines[300]];
  }
}
const column = (values) => ({ min: Float32Array.from(values), max: Float32Array.from(values) });
const gap = [...Array(100).fill(1), NaN, ...Array(300).fill(2), NaN, ...Array(80).fill(3)];
const picture = { first: 100, cycles: 2, pixels: 2, columns: [column([1.5, NaN])] };
const both = { min: Float32Array.of(1, 2), max: Float32Array.of(3, 4) };
const few = { ...picture, cycles: 20, columns: [both] };
const channels = [{ name: "a,b", unit: "V" }];
console.log(JSON.stringify({
  found, usable: [...new Set(usable(column(gap)))], length: usable(column(gap)).length,
  none: usable(column(Array(63).fill(1))), csv: csv(picture, channels, 0.001, 100),
  few: csv(few, channels, 0.001, 100),
}));
"""


def test_the_spectrum_has_the_amplitude_of_a_sine_and_a_table_what_is_shown(
    tmp_path: Path,
) -> None:
    """The modules that need no DOM, in node."""
    if not shutil.which("node"):
        pytest.skip("no node and npm here: the page's modules need it")
    for file in PAGE.glob("*.js"):
        shutil.copy(file, tmp_path)
    (tmp_path / "package.json").write_text('{"type":"module"}')
    (tmp_path / "test.js").write_text(SPECTRUM_TEST)
    done = subprocess.run(
        ["node", "test.js"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    got = json.loads(done.stdout)
    for window in ("hann", "flattop", "rectangular"):
        line, amplitude, mean, _ = got["found"][f"{window} 40"]
        assert (line, amplitude, mean) == pytest.approx((40, 0.5, 3), abs=1e-9)
    loss = {w: 1 - got["found"][f"{w} 40.5"][1] / 0.5 for w in ("hann", "flattop", "rectangular")}
    assert abs(loss["flattop"]) < 2e-3
    assert loss["hann"] == pytest.approx(0.151, abs=5e-3)
    assert loss["rectangular"] == pytest.approx(0.363, abs=1e-2)
    far = {w: got["found"][f"{w} 40.5"][3] for w in loss}
    assert far["hann"] < far["rectangular"] / 1000
    assert (got["usable"], got["length"], got["none"]) == ([2], 256, None)
    assert got["csv"] == 'cycle,time [s],"a,b [V]"\r\n100,0,1.5\r\n101,0.001,\r\n'
    assert got["few"] == (
        'cycle,time [s],"a,b [V] min","a,b [V] max"\r\n100,0,1,3\r\n110,0.01,2,4\r\n'
    )


# For each column of pixels of the plot the middle of the rows in the first channel's colour.
CURVE = """(() => {
  const canvas = document.querySelector('#scope-canvas');
  const { width, height } = canvas;
  const copy = Object.assign(document.createElement('canvas'), { width, height });
  const context = copy.getContext('2d', { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, width, height).data;
  const colour = getComputedStyle(canvas).getPropertyValue('--c0').trim();
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
  const found = [];
  for (let x = 64; x < width - 64; x++) {
    let sum = 0;
    let count = 0;
    for (let y = 0; y < height; y++) {
      const i = 4 * (y * width + x);
      if (Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60) {
        sum += y;
        count++;
      }
    }
    found.push(count === 0 ? null : sum / count);
  }
  return found;
})()"""


def open_scope(
    bench: Bench, web: Web, make_browser: Callable[..., Browser], more: str = "", *options: str
) -> Browser:
    """On a live sine of 1 Hz, with a trigger at its rise through 1 V."""
    bench.produce("--cycles", "1000000", "--pace", *options)
    place = f"#scope?c={ADC}&w=2&edge=rising&t={ADC}&l=1&m=normal{more}"
    browser = make_browser(web, place)
    note = "document.querySelector('#scope-note').textContent"
    browser.wait_for(f"{note}.includes('trigger at cycle')")
    return browser


def pause(browser: Browser) -> None:
    browser.value("document.querySelector('#scope-pause').click()")
    note = "document.querySelector('#scope-note').textContent"
    browser.wait_for(f"{note}.startsWith('paused')")


def test_the_channels_of_the_address_are_kept_until_there_is_a_master(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, f"#scope?c={ADC1}&w=1&edge=bad&t={ADC1}")
    browser.wait_for("document.querySelector('#word').textContent === 'OFF'")
    bench.produce("--cycles", "2000", "--wait")
    browser.wait_for(f"{SEEN} > 0.7")
    shown = (
        "[...document.querySelectorAll('#scope-rows tr td:first-child')].map((c) => c.textContent)"
    )
    assert browser.value(shown) == [ADC1]
    assert field(browser, "t") == ADC1


def test_the_pixels_are_the_sine_that_was_measured(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    pause(browser)
    rows = browser.value(CURVE)
    assert rows.count(None) <= 4  # where the trigger's level and a grid line cross it
    points = [(k / len(rows), row) for k, row in enumerate(rows) if row is not None]

    def share(of: Callable[[float], float]) -> float:
        return sum(row * of(4 * math.pi * at) for at, row in points) / len(points)

    middle, a, b = share(lambda _: 1), 2 * share(math.cos), 2 * share(math.sin)
    residues = [
        row - middle - a * math.cos(4 * math.pi * at) - b * math.sin(4 * math.pi * at)
        for at, row in points
    ]
    amplitude = math.hypot(a, b)
    assert amplitude > 100
    assert math.sqrt(sum(r * r for r in residues) / len(residues)) < 0.03 * amplitude


def mouse(browser: Browser, kind: str, part: float, **more: Any) -> None:
    """At a place of the plot, from 0 on its left to 1."""
    x, y, width, height = browser.value(
        "(() => { const r = document.querySelector('#scope-canvas').getBoundingClientRect();"
        " return [r.x, r.y, r.width, r.height]; })()"
    )
    at = x + 64 + part * (width - 128)
    browser.tell("Input.dispatchMouseEvent", type=kind, x=at, y=y + height / 2, **more)


def drag(browser: Browser, start: float, end: float) -> None:
    mouse(browser, "mousePressed", start, button="left", clickCount=1)
    mouse(browser, "mouseMoved", (start + end) / 2, button="left", buttons=1)
    mouse(browser, "mouseMoved", end, button="left", buttons=1)
    mouse(browser, "mouseReleased", end, button="left")


def numbers(browser: Browser, count: int = 8) -> list[float]:
    """Min, max, mean, RMS, Hz, at A, at B, B - A of the first channel, so many of them."""
    cells = "[...document.querySelectorAll('#scope-rows tr:first-child td')]"
    return [float(t) for t in browser.value(f"{cells}.map((c) => c.textContent)")[2 : 2 + count]]


def test_cursors_measure_half_a_volt_and_the_trigger_one_hertz(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    browser.value("document.querySelector('#scope-cursors').click()")
    browser.wait_for("document.querySelector('#scope-cursor-text').textContent !== ''")
    # A is at the trigger, at a quarter of the picture; B goes to the maximum behind it.
    drag(browser, 0.75, 0.25 + 0.125)
    *_, hertz, at_a, at_b, step = numbers(browser)
    assert f"{hertz:.3f}" == "1.000"
    assert (at_a, at_b) == pytest.approx((1.0, 1.5), abs=0.01)
    assert step == pytest.approx(0.5, abs=0.01)
    between = re.fullmatch(r"B \u2212 A: (\d+) ms, .* Hz", browser.text("#scope-cursor-text"))
    assert between is not None
    assert int(between[1]) == pytest.approx(250, abs=5)
    assert browser.problems() == []


def field(browser: Browser, name: str) -> str | None:
    return browser.value(f"new URLSearchParams(location.hash.split('?')[1]).get({name!r})")


def test_drag_wheel_and_touch_go_into_the_past_and_the_measurement_goes_on(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    browser.wait_for(
        "Number(document.querySelector('#scope-note').textContent.match(/\\d+/)) > 4000"
    )
    mouse(browser, "mouseMoved", 0.5)
    drag(browser, 0.4, 0.6)
    browser.wait_for("location.hash.includes('end=')")
    end = int(field(browser, "end") or 0)
    mouse(browser, "mouseWheel", 0.25, deltaX=0, deltaY=-100)
    browser.wait_for("location.hash.includes('w=1&')")
    # What was at a quarter stays there: 1.5 s to the right are 0.75 s now.
    assert int(field(browser, "end") or 0) == pytest.approx(end - 750, abs=2)
    mouse(browser, "mouseWheel", 0.25, deltaX=-200, deltaY=0)
    browser.wait_for(f"!location.hash.includes('end={field(browser, 'end')}&') ")
    fingers = [[{"x": 400, "y": 300, "id": 0}, {"x": 500, "y": 300, "id": 1}]]
    fingers.append([{"x": 300, "y": 300, "id": 0}, {"x": 600, "y": 300, "id": 1}])
    for kind, points in (("touchStart", fingers[0]), ("touchMove", fingers[1]), ("touchEnd", [])):
        browser.tell("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    browser.wait_for("location.hash.includes('w=0.5&')")
    assert browser.wait_for(SEEN) > 0.7
    browser.value("document.querySelector('#scope-live').click()")
    note = "document.querySelector('#scope-note').textContent"
    newest = f"Number({note}.match(/trigger at cycle (\\d+)/)?.[1])"
    browser.wait_for(f"{newest} > {end}")
    assert browser.problems() == []


def test_a_channel_is_drawn_with_its_scale_and_offset_and_measured_without(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    browser.value(f"location.hash = '#scope?c={ADC},{ADC1}&w=2&y=0.1:2,1:0'")
    browser.wait_for("document.querySelectorAll('#scope-rows tr').length === 2")
    # Until the next picture the canvas shows the one before: there the sine takes all of it.
    span = f"""(() => {{
      const rows = {CURVE}.filter((row) => row !== null);
      const height = document.querySelector('#scope-canvas').height - 32;
      const share = (Math.max(...rows) - Math.min(...rows)) / height;
      return {SEEN} > 0.7 && share < 0.5 && share;
    }})()"""
    # Of 1.1 V and 8 % of room on both sides, it takes 0.1 V.
    assert browser.wait_for(span) == pytest.approx(0.1 / 1.65 / 1.16, abs=0.03)
    assert numbers(browser, 2) == pytest.approx([0.5, 1.5], abs=3e-3)
    field_of = "document.querySelector('#scope-rows tr:first-child input')"
    assert browser.value(f"{field_of}.value") == "0.1"
    browser.value(f"{field_of}.value = '3'; {field_of}.dispatchEvent(new Event('change'))")
    browser.wait_for("decodeURIComponent(location.hash).includes('y=3:2,1:0')")
    assert browser.problems() == []


@pytest.mark.parametrize("window", ["hann", "flattop", "rectangular"])
def test_the_spectrum_shows_the_line_of_the_sine(
    bench: Bench, web: Web, make_browser: Callable[..., Browser], window: str
) -> None:
    browser = open_scope(bench, web, make_browser, f"&a=fft&aw={window}")
    browser.value("location.hash = location.hash.replace('w=2', 'w=5')")
    note = "document.querySelector('#analysis-note').textContent"
    text = browser.wait_for(f"{note}.includes(', 0.2441 Hz a line') && {note}")  # 4096 samples
    found = re.search(rf"{ADC}: ([\d.]+) Hz, ([\d.]+) V", text)
    assert found is not None
    assert float(found[1]) == pytest.approx(1, abs=0.25)
    assert float(found[2]) == pytest.approx(0.5, abs=0.03)
    assert browser.problems() == []


def test_one_channel_over_another_is_a_circle(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    browser.value(f"location.hash = '#scope?c={ADC},{ADC1}&w=2&a=xy'")
    note = "document.querySelector('#analysis-note').textContent"
    browser.wait_for(f"{note} === '{ADC1} over {ADC}'")
    canvas = "document.querySelector('#analysis-canvas')"
    middle = f"""(() => {{
      const {{ width, height }} = {canvas};
      const copy = Object.assign(document.createElement('canvas'), {{ width, height }});
      const context = copy.getContext('2d', {{ willReadFrequently: true }});
      context.drawImage({canvas}, 0, 0);
      const data = context.getImageData(0, 0, width, height).data;
      const hits = [];
      for (let i = 0; i < data.length; i += 4) {{
        if (data[i] > 140 && data[i + 1] < 90 && data[i + 2] < 90) {{
          const [x, y] = [(i / 4) % width, Math.floor(i / 4 / width)];
          hits.push([(x - 64) / (width - 128), (y - 8) / (height - 32)]);
        }}
      }}
      return hits;
    }})()"""
    browser.wait_for(f"{middle}.length > 100")
    radii = [math.hypot(x - 0.5, y - 0.5) for x, y in browser.value(middle)]
    # Range and 5 % of room on both sides.
    assert (min(radii), max(radii)) == pytest.approx((0.4545, 0.4545), abs=0.02)
    assert browser.problems() == []


SAVED = """
window.saved = [];
URL.createObjectURL = (blob) => {
  const reader = new FileReader();
  reader.onload = () => saved.push(reader.result);
  reader.readAsDataURL(blob);
  return 'blob:of-a-test';
};
HTMLAnchorElement.prototype.click = function () { window.named = this.download; };
"""


def test_what_is_shown_is_saved_as_png_svg_and_csv(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = open_scope(bench, web, make_browser)
    pause(browser)
    browser.value(SAVED)
    got = []
    for kind in ("png", "svg", "csv"):
        browser.value(
            f"{{ const s = document.querySelector('#scope-save'); s.value = '{kind}';"
            " s.dispatchEvent(new Event('input')); }"
        )
        browser.wait_for(f"saved.length === {len(got) + 1}")
        got.append(base64.b64decode(browser.value("saved.at(-1)").partition(",")[2]))
        assert re.fullmatch(rf"ecdaq-\d+-\d+\.{kind}", browser.value("named"))
    png, svg, csv = got
    assert png.startswith(b"\x89PNG")
    root = ET.fromstring(svg)
    paths = [e.get("d", "") for e in root.iter("{http://www.w3.org/2000/svg}path")]
    assert max(path.count("L") for path in paths) > 500
    lines = csv.decode().split("\r\n")
    assert lines[0] == f"cycle,time [s],{ADC} [V] min,{ADC} [V] max"
    values = [line.split(",") for line in lines[1:-1]]
    assert len(values) > 500
    low, high = min(float(v[2]) for v in values), max(float(v[3]) for v in values)
    assert (low, high) == pytest.approx((0.5, 1.5), abs=3e-3)
    zero = min(values, key=lambda v: abs(float(v[1])))  # the trigger
    assert float(zero[2]) == pytest.approx(1, abs=0.02)


def test_events_are_marks_in_the_picture(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    bench.produce("--cycles", "3000", "--wait", "--events", "20")
    browser = make_browser(web, f"#scope?c={ADC}&w=1&end=1000")
    text = browser.wait_for(
        "document.querySelector('#scope-events').textContent.startsWith('10 events')"
        " && document.querySelector('#scope-events').textContent"
    )
    assert text.count("\u00b7") == 4
    browser.value("location.hash = '#scope?c=piccolo0.adc&w=1&end=2950'")
    browser.wait_for("document.querySelector('#scope-events').textContent === ''")
    assert browser.problems() == []


def test_a_page_that_stays_open_does_not_grow(
    bench: Bench, web: Web, make_browser: Callable[..., Browser]
) -> None:
    """By counts: of what is in the document, and of the heap for so many more pictures."""
    browser = open_scope(bench, web, make_browser, "&a=fft")
    browser.tell("Network.enable")

    def after_frames(count: int) -> dict[str, float]:
        browser.seen.clear()
        while sum(m["method"] == "Network.webSocketFrameReceived" for m in browser.seen) < count:
            browser.value("new Promise((done) => setTimeout(() => done(1), 100))")
        browser.seen.clear()
        browser.tell("HeapProfiler.collectGarbage")
        metrics = browser.tell("Performance.getMetrics")["metrics"]
        return {m["name"]: m["value"] for m in metrics}

    browser.tell("Performance.enable")
    first = after_frames(60)
    second = after_frames(240)
    assert second["Nodes"] <= first["Nodes"] + 50
    assert second["JSEventListeners"] <= first["JSEventListeners"]
    assert second["JSHeapUsedSize"] < 1.5 * first["JSHeapUsedSize"]
