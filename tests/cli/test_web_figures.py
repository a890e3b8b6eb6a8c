# SPDX-License-Identifier: MIT
"""What `./build.sh measure web` prints of clients with history: a short one."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from recording import PRODUCER, Bench
from web_bench import WEB, Web
from web_client import Page
from web_figures import on_history, print_history


def test_history_is_open_up_to_the_newest_sample_and_costs_are_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    if not WEB.exists():
        pytest.skip("ecdaq-web is not built: it requires libwebsockets-dev and libcjson-dev")
    on_history(PRODUCER, 120_000, lambda web: print_history(web, 0.5, 120_000))
    text = capsys.readouterr().out
    assert re.search(r"^  2 min of history: \d+\.\d+ GB$", text, re.M), text
    assert re.search(r"first picture after \d+\.\d+ s, 0 of 900 columns empty", text), text
    rows = re.findall(r"Scope, 2 min, \d clients +(\d+\.\d) kB/s +-?\d+\.\d\d % ", text)
    assert len(rows) == 2 and all(float(row) > 0 for row in rows), text


def test_64_slaves_have_16_channels_each(bench: Bench, web: Web) -> None:
    bench.start(Path(f"{PRODUCER}_64x16"), bench.run_dir, "--cycles", "2000", "--wait")
    page = Page(web.port)
    table = page.wait_for("table", lambda m: m["channels"])
    names = [channel["name"] for channel in table["channels"]]
    assert (len(names), names[16], names[31]) == (1025, "piccolo1.adc", "piccolo1.sample_time")
    _, values, _ = page.draw(channels=[13, 14], cycles=1000, pixels=1000, end=1000)
    assert values[0][:1000] == pytest.approx(values[0][1000:])
    assert 0.4 < min(values[0]) < 0.6 and 1.4 < max(values[0]) < 1.6  # the sine
    assert values[1][:1000] == list(range(1000))  # the counter
