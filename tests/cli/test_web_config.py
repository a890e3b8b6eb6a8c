# SPDX-License-Identifier: MIT
"""The configuration in effect and the checks of the machine, on the page of ecdaq-web."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from browser import Browser
from ecdaq import Fake
from recording import Bench
from web_bench import Web
from web_client import http, unchunk

VISIBLE = "Array.from(document.querySelectorAll('#{}-rows tr')).filter((r) => !r.hidden).length"
NOTE = "document.querySelector('#{}-note').textContent"


def shown(daemon: Fake, config: Path) -> str:
    return daemon("--config", str(config), "config", "show", "--json").stdout


@pytest.fixture
def config(tmp_path: Path) -> Path:
    file = tmp_path / "ecdaq.yaml"
    file.write_text("record:\n  rotate_period: 10min\nslaves:\n  - {name: front}\n")
    return file


@pytest.fixture
def web(make_web: Callable[..., Web], config: Path) -> Web:
    return make_web(config)


def test_the_server_has_what_the_commands_print(daemon: Fake, web: Web, config: Path) -> None:
    status, headers, body = http(web.port, "GET /config.json")
    assert (status, headers["content-type"]) == (200, "application/x-ndjson")
    assert unchunk(body).decode() == shown(daemon, config)
    status, headers, body = http(web.port, "GET /doctor.json")
    assert (status, headers["content-type"]) == (200, "application/json")
    served = json.loads(unchunk(body))
    printed = json.loads(daemon("doctor", "--json").stdout)
    assert [c["name"] for c in served["check"]] == [c["name"] for c in printed["check"]]
    assert served["fail"] == printed["fail"]


def test_settings_of_the_file_are_seen_first_and_all_on_request(
    daemon: Fake, web: Web, config: Path, make_browser: Callable[..., Browser]
) -> None:
    options = [json.loads(line) for line in shown(daemon, config).splitlines()]
    own = [option for option in options if option["origin"] != "default"]
    assert len(own) >= 2
    browser = make_browser(web)
    browser.value("location.hash = '#config'")
    browser.wait_for(f"{NOTE.format('config')} === '{len(own)} of {len(options)} options'")
    assert browser.value(VISIBLE.format("config")) == len(own)
    browser.value("document.querySelector('#config-all').click()")
    assert browser.value(VISIBLE.format("config")) == len(options)
    browser.value(
        "document.querySelector('#config-filter').value = 'record.', "
        "document.querySelector('#config-filter').dispatchEvent(new Event('input'))"
    )
    records = [option for option in options if "record." in option["option"]]
    assert len(records) > 3
    assert browser.value(VISIBLE.format("config")) >= len(records)
    assert browser.value(VISIBLE.format("config")) < len(options)
    row = "Array.from(document.querySelectorAll('#config-rows tr')).find((r) => r.children[0]"
    cells = f"{row}.textContent === 'record.rotate_period').children"
    (wanted,) = (option for option in options if option["option"] == "record.rotate_period")
    assert (wanted["value"], browser.value(f"{cells}[4].textContent")) == (
        "10min",
        f"{config.name}:2",
    )
    assert browser.value(f"{cells}[1].textContent") == wanted["value"]
    assert str(config) in browser.value("document.querySelector('#config-file').textContent")
    assert browser.value(f"{cells}[5].textContent") == wanted["takes_effect"]
    assert browser.problems() == []


def test_channels_say_who_writes_an_output_and_its_limits(
    bench: Bench,
    make_web: Callable[..., Web],
    make_browser: Callable[..., Browser],
    tmp_path: Path,
) -> None:
    file = tmp_path / "outputs.yaml"
    file.write_text(
        "slaves:\n  - name: piccolo0\n  - name: piccolo1\n    outputs:\n"
        "      - {channel: led, owner: remote, min: 0, max: 1, fail_safe: 1}\n"
    )
    bench.produce("--cycles", "1000", "--wait")
    browser = make_browser(make_web(file), "#channels")
    row = "[...document.querySelectorAll('#channel-rows tr')].find((r) => r.children[0]"
    cell = f"{row}.textContent === 'piccolo1.led')?.children[5].textContent"
    assert browser.wait_for(cell) == "remote; 0 to 1; fail-safe 1"
    assert browser.value(f"{row}.textContent === 'piccolo0.adc').children[5].textContent") == ""
    assert browser.problems() == []


def test_the_state_has_what_the_doctor_finds_and_what_to_do(
    daemon: Fake, web: Web, make_browser: Callable[..., Browser]
) -> None:
    found = json.loads(daemon("doctor", "--json").stdout)
    browser = make_browser(web)
    browser.wait_for("document.querySelectorAll('#doctor-rows tr').length > 0")
    note = browser.value(NOTE.format("doctor"))
    assert note.startswith(f"{found['fail']} to fix, {found['warn']} warnings")
    assert browser.value(VISIBLE.format("doctor")) == found["fail"] + found["warn"] > 0
    bad = next(c for c in found["check"] if c["level"] in ("FAIL", "WARN"))
    assert bad["remedy"] in browser.value("document.querySelector('#doctor-rows').textContent")
    browser.value("document.querySelector('#doctor-all').click()")
    assert browser.value(VISIBLE.format("doctor")) == len(found["check"])
    assert browser.problems() == []
