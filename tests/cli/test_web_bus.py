# SPDX-License-Identifier: MIT
"""The view Bus of ecdaq-web: the tree of ports, expected beside found, one slave."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ecdaq import BUILD, ROOT, Fake, json_of, works
from web_bench import Web
from web_client import Page

PAGE = ROOT / "app" / "services" / "web" / "page"
EXPECTED = {
    "slaves[0].vendor": "2",
    "slaves[0].product": "0x04570862",
    "slaves[0].revision": "0x0258008e",
    "slaves[1].name": "rear",
}


def bus_of(page: Page, is_wanted: Callable[[dict[str, Any]], bool] = bool) -> dict[str, Any]:
    page.ask(op="bus", on=True)
    return page.wait_for("bus", is_wanted)


def slave_of(page: Page, position: int) -> dict[str, Any]:
    page.ask(op="bus", on=True, slave=position)
    return page.wait_for("slave", lambda m: m["position"] == position)


def test_the_tree_has_states_cables_and_their_errors(fake: Callable[..., Fake], web: Web) -> None:
    fake("SPEED=1")
    bus = bus_of(Page(web.port))
    assert (bus["interface"], bus["alive"], bus["expected"]) == ("ecat0", True, 2)
    first, second = bus["slaves"]
    assert (first["name"], first["state"], first["level"]) == ("piccolo0", "OP", "good")
    assert (first["parent"], first["port"], "cable_ns" in first) == (-1, 0, False)
    assert (second["parent"], second["parent_port"], second["cable_ns"]) == (0, 1, 310)
    # Its AL status code is that of the SyncManager watchdog; 3 errors at port 0.
    assert (second["level"], second["errors"], second["links"]) == ("warning", 3, 0)
    assert second["device"].startswith("FB1111-Piccolo")


def test_the_tree_is_the_one_of_the_command_line(
    fake: Callable[..., Fake], web: Web, tmp_path: Path
) -> None:
    if not shutil.which("node"):
        pytest.skip("no node here: the page's modules need it")
    daemon = fake("BRANCHES=1")
    bus = bus_of(Page(web.port))
    listed = json_of(daemon("topology", "--json"))
    assert len(listed) == len(bus["slaves"]) == 5
    for slave, other in zip(bus["slaves"], listed, strict=True):
        parent = -1 if other["parent"] is None else other["parent"]
        assert (slave["name"], slave["state"]) == (other["name"], other["state"])
        assert (slave["parent"], slave["port"]) == (parent, other["port"])
    shutil.copy(PAGE / "tree.js", tmp_path)
    (tmp_path / "package.json").write_text('{"type":"module"}')
    (tmp_path / "test.js").write_text(
        'import { branches } from "./tree.js";\n'
        f"console.log(JSON.stringify(branches({json.dumps(bus['slaves'])})));\n"
    )
    done = subprocess.run(
        ["node", "test.js"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    drawn = [
        text.replace("├ ", "+-").replace("│", "|") + slave["name"]
        for text, slave in zip(json.loads(done.stdout), bus["slaves"], strict=True)
    ]
    names = works(daemon("topology")).splitlines()[1:]
    assert any("+-" in name for name in drawn)
    for name, line in zip(drawn, names, strict=True):
        assert line[4:].startswith(f"{name} "), (name, line)


def test_one_slave_has_identity_counters_and_what_is_expected(
    fake: Callable[..., Fake], make_web: Callable[..., Web]
) -> None:
    fake("SPEED=1", "ITEMS=1,2")
    page = Page(make_web(**EXPECTED).port)
    slave = slave_of(page, 0)
    assert slave["found"] == {
        "vendor": "0x00000002", "product": "0x04570862", "revision": "0x0258008d",
        "serial": "0x00000000", "alias": 0,
    }  # fmt: skip
    assert slave["expected"] == {
        "vendor": "0x00000002", "product": "0x04570862", "revision": "0x0258008e",
    }  # fmt: skip
    assert slave["clock"]["reference"] is True
    assert slave["samples_good"] > 0
    slave = slave_of(page, 1)
    assert (slave["name"], slave["station"]) == ("piccolo1", "0x1002")
    assert (slave["code"], slave["code_text"]) == ("0x001b", "SyncManager watchdog")
    assert slave["hint"] != ""
    assert (slave["rx_errors"], slave["lost_links"]) == ([3, 0, 0, 0], [0, 255, 0, 0])
    assert (slave["forwarded_errors"], slave["pdi_errors"]) == ([0, 0, 4, 0], 5)
    assert slave["short"] is True
    assert slave["clock"]["difference_ns"] == -7
    for position in (2, 511, 512, 4294967295):
        assert "name" not in slave_of(page, position)


@pytest.mark.parametrize(
    ("items", "missing"),
    [
        ("1,2", []),
        ("1,0", [("rear", "missing", "bad")]),
        ("0,2", [("slaves[0]", "missing", "bad")]),
        # The daemon could not say which slave is which.
        ("0,0", [("slaves[0]", "expected", "warning"), ("rear", "expected", "warning")]),
    ],
)
def test_what_the_configuration_expects_and_nobody_found_is_listed(
    fake: Callable[..., Fake],
    make_web: Callable[..., Web],
    items: str,
    missing: list[tuple[str, str, str]],
) -> None:
    fake("SPEED=1", f"ITEMS={items}")
    bus = bus_of(Page(make_web(**EXPECTED).port))
    assert bus["same_config"] is True
    assert [(m["name"], m["state"], m["level"]) for m in bus["missing"]] == missing


def test_another_configuration_than_the_daemons_compares_nothing(
    fake: Callable[..., Fake], make_web: Callable[..., Web]
) -> None:
    fake("SPEED=1", "ITEMS=1,0")
    page = Page(make_web(**{"slaves[0].name": "front"}).port)
    bus = bus_of(page)
    assert (bus["same_config"], "missing" in bus) == (False, False)
    assert "expected" not in slave_of(page, 0)


def test_without_a_daemon_there_is_no_bus_and_after_its_end_the_last_one(
    fake: Callable[..., Fake], web: Web
) -> None:
    page = Page(web.port)
    bus = bus_of(page)
    assert (bus["alive"], bus["slaves"]) == (False, [])
    daemon = fake("SPEED=1")
    assert len(bus_of(page, lambda m: m["alive"])["slaves"]) == 2
    daemon.process.kill()
    daemon.process.wait()
    assert len(bus_of(page, lambda m: not m["alive"])["slaves"]) == 2


def test_nothing_is_sent_of_a_bus_that_does_not_change_or_that_nobody_sees(
    fake: Callable[..., Fake], web: Web
) -> None:
    fake("SPEED=1", program=BUILD / "tests" / "cli" / "test_fake_daemon_512")
    page = Page(web.port)
    assert len(bus_of(page, lambda m: len(m["slaves"]) == 512)["slaves"]) == 512
    page.newest.clear()
    for _ in range(8):
        page.wait_for("state")
    assert "bus" not in page.newest
    page.ask(op="bus", on=False)
    slave_of(page, 3)
    page.ask(op="bus", on=False)
    page.wait_for("state")
    page.wait_for("state")
    page.newest.clear()
    for _ in range(4):
        page.wait_for("state")
    assert not {"bus", "slave"} & set(page.newest)
