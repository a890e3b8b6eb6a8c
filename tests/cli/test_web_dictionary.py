# SPDX-License-Identifier: MIT
"""The object dictionary of a slave in the view Bus: read by ecdaq-web-command, few at a time."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import npm
import pytest
from browser import Browser
from ecdaq import ROOT, Fake, works
from recording import wait_until
from test_web_views import AXE, FOUND
from web_bench import Web
from web_session import ROLES, Session, WebCommand, expect_by_role

PAGE = ROOT / "app" / "services" / "web" / "page"
LISTED = [0x6000, 0x7000, 0x8001]


def ask(session: Session, *words: str) -> tuple[int, str]:
    """When it is its turn."""
    answers: list[tuple[int, str]] = []

    def is_answered() -> bool:
        answers.append(session.ask(*words))
        return answers[-1][0] != 429

    wait_until("an answer", is_answered)
    return answers[-1]


def test_an_operator_reads_the_dictionary_in_parts(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    status, text = ask(session, "objects", "0", "0x0001")
    assert (status, json.loads(text)) == (200, {"slave": 0, "indices": LISTED, "left": 0})
    status, text = ask(session, "object", "0", "0x8001:00")
    found = json.loads(text)
    assert (found["index"], found["last"]) == (0x8001, 5)
    assert [entry["subindex"] for entry in found["entry"]] == [0, 1, 2, 3]
    status, text = ask(session, "object", "0", "0x8001:04")
    assert [entry["subindex"] for entry in json.loads(text)["entry"]] == [4, 5]
    works(daemon("sdo", "write", "0", "0x8001:2", "250", "--type", "UINT"))
    status, text = ask(session, "read", "0", "0x8001:2")
    assert (status, json.loads(text)["bytes"]) == (200, "fa 00")
    status, text = ask(session, "read", "0", "0x8001:1")
    assert (status, "SDO read: object does not exist" in text) == (409, True)
    # What is only read is no line of the log.
    assert not [line for line in web_command.stop().splitlines() if "read" in line or "obj" in line]


@pytest.mark.parametrize("role", ROLES)
def test_objects_are_read_by_operators_and_written_by_engineers(
    daemon: Fake, web: Web, web_command: WebCommand, role: str
) -> None:
    session = Session(web, web_command.token(role))
    commands = (
        ("operator", ("objects", "0", "0x0001")),
        ("operator", ("object", "0", "0x8001")),
        ("operator", ("read", "0", "0x8001:2")),
        ("engineer", ("write", "UINT", "0", "0x8001:2", "7")),
    )
    expect_by_role(role, commands, partial(ask, session))
    value = works(daemon("sdo", "read", "0", "0x8001:2", "--type", "UINT")).strip()
    assert (value == "7") == (role == "engineer")
    assert ("engineer 1: write UINT 0 0x8001:2 7: done" in web_command.stop()) == (
        role == "engineer"
    )


def test_words_that_are_no_object_are_refused_and_cost_nothing(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("engineer"))
    for words in (
        ("objects",), ("objects", "0"), ("objects", "-1", "0x1000"), ("objects", "all", "0x1000"),
        ("object", "0", "--help"), ("object", "0", "0x1000;"), ("object", "0", "0x1000", "1"),
        ("read", "0", ""), ("read", "0", "--complete"), ("read", "0", "0x1000:1 "),
        ("write", "UINT", "0", "0x8001:2"), ("write", "UINT", "0", "0x8001:2", "--complete"),
        ("write", "-t", "0", "0x8001:2", "1"), ("write", "UINT", "0", "0x8001:2", "1", "2"),
    ):  # fmt: skip
        assert session.ask(*words)[0] == 400, words
    # The tool refuses what has the form only.
    for words, why in (
        (("read", "0", "0x10000"), "expected INDEX:SUB"),
        (("read", "9", "0x1018:1"), "no slave at this position"),
        (("write", "UINT", "0", "0x8001:2", "65536"), "does not fit into UINT"),
        (("write", "NOPE", "0", "0x8001:2", "1"), "--type: NOPE"),
        (("write", "INT", "0", "0x8001:1", "-5"), "data cannot be stored"),
    ):
        status, text = ask(session, *words)
        assert (status, why in text) == (409, True), (words, text)


def test_a_mailbox_is_asked_a_few_times_a_second_whoever_asks(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    sessions = [Session(web, web_command.token("operator")) for _ in range(3)]
    started = time.monotonic()
    done = refused = 0
    while done < 5:
        for session in sessions:
            status, text = session.ask("read", "0", "0x8001:2")
            assert status in (200, 429), text
            done += status == 200
            refused += status == 429
        # Other commands have their turn at any time.
        assert sessions[0].ask("set", "piccolo0.led", "1")[0] == 200
    assert refused > 0
    assert time.monotonic() - started >= 4 * 0.2
    # An object with four entries costs five.
    assert ask(sessions[0], "object", "0", "0x8001")[0] == 200
    started = time.monotonic()
    assert ask(sessions[1], "read", "0", "0x8001:2")[0] == 200
    assert time.monotonic() - started >= 0.5


def test_an_object_of_2048_bytes_is_read_whole(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    status, text = ask(session, "read", "0", "0x2000")
    assert (status, len(json.loads(text)["bytes"])) == (200, 3 * 2048 - 1)


def test_values_are_shown_as_their_type_says(tmp_path: Path) -> None:
    if not shutil.which("node"):
        pytest.skip("no node here: the page's modules need it")
    shutil.copy(PAGE / "object_value.js", tmp_path)
    (tmp_path / "package.json").write_text('{"type":"module"}')
    cases = [
        ("UINT", "fa 00", "250 = 0x00fa"),
        ("INT", "fb ff", "-5"),
        ("SINT", "80", "-128"),
        ("BOOL", "01", "1"),
        ("UDINT", "62 08 57 04", "72812642 = 0x04570862"),
        ("LINT", "ff ff ff ff ff ff ff ff", "-1"),
        ("ULINT", "01 00 00 00 00 00 00 80", "9223372036854775809 = 0x8000000000000001"),
        ("REAL", "00 00 c0 3f", "1.5"),
        ("LREAL", "00 00 00 00 00 00 f8 3f", "1.5"),
        ("STRING", "46 42 31 1b 00 41", "FB1?"),
        ("STRING", "", ""),
        ("UINT", "fa", "fa"),
        ("0x0801", "01 02 03", "01 02 03"),
        ("toString", "01", "01"),
    ]
    (tmp_path / "test.js").write_text(
        'import { decode, is_number_type } from "./object_value.js";\n'
        f"const cases = {json.dumps(cases)};\n"
        "const all = ['BOOL', 'LINT', 'UINT', 'LREAL', 'STRING', 'BIT1', '0x0801'];\n"
        "console.log(JSON.stringify([cases.map(([type, bytes]) => decode(type, bytes)),"
        " all.map(is_number_type)]));\n"
    )
    done = subprocess.run(
        ["node", "test.js"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    values, writable = json.loads(done.stdout)
    assert values == [value for _, _, value in cases]
    assert writable == [True, True, True, True, False, False, False]


def problems(browser: Browser) -> list[str]:
    """But the answers of what a slave has refused, and of another one's turn."""
    found = [json.dumps(problem) for problem in browser.problems()]
    return [problem for problem in found if not re.search("status of (409|429)", problem)]


LINE = """[...document.querySelectorAll('#objects-rows tr')]
  .find((line) => line.children[0].textContent === {!r})"""


def cell(browser: Browser, place: str, column: int, wanted: str) -> None:
    browser.wait_for(f"({LINE.format(place)})?.children[{column}].textContent.includes({wanted!r})")


def press_key(browser: Browser, selector: str) -> None:
    browser.value(f"{selector}.focus()")
    for kind in ("keyDown", "keyUp"):
        browser.tell("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", text="\r",
                     windowsVirtualKeyCode=13)  # fmt: skip


def test_the_dictionary_has_live_values_in_a_browser(
    daemon: Fake, web: Web, web_command: WebCommand, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, f"#token={web_command.token('engineer')}")
    browser.wait_for("document.querySelector('#session-role').textContent === 'engineer'")
    browser.value("location.hash = '#bus?s=0'")
    button = "document.querySelector('#objects-open')"
    browser.wait_for(f"{button}.offsetWidth > 0")
    browser.value("""void (globalThis.asked = [], globalThis.plain = fetch, globalThis.fetch =
      (path, how) =>
      (asked.push([performance.now(), how.body.split('\\n')[1]]), plain(path, how)))""")
    press_key(browser, button)
    browser.wait_for("document.querySelector('#objects-note').textContent === '3 objects'")
    # Names come without a click; an object that cannot be described says why.
    cell(browser, "0x8001", 1, "ooo")
    cell(browser, "0x7000", 2, "description: general error")
    press_key(browser, LINE.format("0x8001") + ".querySelector('button')")
    cell(browser, "0x8001:05", 2, "UINT, 16 bit")
    cell(browser, "0x8001:02", 4, " = 0x")
    cell(browser, "0x8001:01", 4, "object does not exist")  # an SDO abort, in its row
    works(daemon("sdo", "write", "0", "0x8001:2", "250", "--type", "UINT"))
    cell(browser, "0x8001:02", 4, "250 = 0x00fa")
    axe = npm.install(AXE, "axe-core") / "node_modules" / "axe-core" / "axe.min.js"
    browser.value(axe.read_text() + "; void 0")
    assert browser.value(FOUND) == []
    # An engineer writes, by keyboard.
    field = LINE.format("0x8001:02") + ".querySelector('input')"
    browser.value(f"{field}.focus()")
    browser.tell("Input.insertText", text="77")
    press_key(browser, field)
    cell(browser, "0x8001:02", 5, "77 written")
    cell(browser, "0x8001:02", 4, "77 = 0x004d")
    # A few a second, and none when the pane is closed.
    asked = browser.value("asked")
    assert len(asked) > 10
    costs = sum({"object": 5}.get(what, 1) for _, what in asked)
    assert costs <= 5 * (asked[-1][0] - asked[0][0]) / 1000 + 6
    press_key(browser, button)
    assert browser.value("document.querySelector('#objects').hidden")
    browser.value("new Promise((done) => setTimeout(done, 600))")
    count = browser.value("asked.length")
    browser.value("new Promise((done) => setTimeout(done, 1000))")
    assert browser.value("asked.length") == count
    assert problems(browser) == []


def test_the_dictionary_ends_with_the_log_in_and_with_the_slave_in_a_browser(
    daemon: Fake, web: Web, web_command: WebCommand, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, "#bus?s=0")
    browser.wait_for("!document.querySelector('#bus-slave').hidden")
    button = "document.querySelector('#objects-open')"
    assert browser.value(f"{button}.offsetWidth") == 0  # for nobody who has not logged in
    browser.value(
        f"document.querySelector('#session-token').value = '{web_command.token('operator')}'"
    )
    press_key(browser, "document.querySelector('#session-token')")
    browser.wait_for(f"{button}.offsetWidth > 0")
    press_key(browser, button)
    cell(browser, "0x8001", 1, "ooo")
    press_key(browser, LINE.format("0x8001") + ".querySelector('button')")
    cell(browser, "0x8001:02", 4, " = 0x")
    assert browser.value(f"({LINE.format('0x8001:02')}).querySelector('form').offsetWidth") == 0
    browser.value("document.querySelector('#objects-filter').value = '0x6'")
    browser.value("document.querySelector('#objects-filter').dispatchEvent(new Event('input'))")
    assert (
        browser.value(
            "[...document.querySelectorAll('#objects-rows tr')].filter((l) => !l.hidden).length"
        )
        == 1
    )
    browser.value("location.hash = '#bus?s=1'")
    browser.wait_for("document.querySelector('#bus-slave-name').textContent.startsWith('1 ')")
    assert browser.value(f"{button}.getAttribute('aria-expanded')") == "false"
    press_key(browser, button)
    browser.wait_for("document.querySelectorAll('#objects-rows tr').length >= 3")
    browser.value("document.querySelector('#session-end').click()")
    browser.wait_for("document.querySelector('#objects').hidden")
    assert browser.value(f"{button}.offsetWidth") == 0
    assert problems(browser) == []
