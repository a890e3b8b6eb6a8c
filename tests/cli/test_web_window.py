# SPDX-License-Identifier: MIT
"""The window that the scope shows, as a recording from ecdaq-web."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import pytest
from browser import Browser
from mcap.reader import make_reader
from recording import Bench, wait_until
from web_bench import Web
from web_client import http, unchunk

SESSION = 4711


@pytest.fixture
def recorded(bench: Bench) -> Bench:
    """Several files of 3000 cycles, of a session with a number that the tests know."""
    bench.produce("--cycles", "3000", "--wait", "--session", str(SESSION), "--no-close")
    recorder = bench.record()

    def is_there() -> bool:
        words = ["--from", "2999", "--to", "2999"]
        return bench.log("export", bench.folder, *words).returncode == 0

    wait_until("the last cycle in the file", is_there)
    recorder.terminate()
    recorder.communicate(timeout=60)
    return bench


@pytest.fixture
def server(bench: Bench, make_web: Callable[..., Web]) -> Web:
    return make_web(record_dir=str(bench.folder))


def get(web: Web, query: str, method: str = "GET") -> tuple[int, dict[str, str], bytes]:
    return http(web.port, f"{method} /window.mcap{query}")


def cycles(data: bytes) -> list[int]:
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    return [raw.sequence for _, _, raw in reader.iter_messages(topics=["/ecdaq/cycle"])]


def test_a_window_is_what_the_command_line_cuts(
    recorded: Bench, server: Web, tmp_path: Path
) -> None:
    status, headers, body = get(server, f"?session={SESSION}&from=500&to=1499")
    assert (status, headers["content-type"]) == (200, "application/octet-stream")
    assert headers["content-disposition"] == 'attachment; filename="ecdaq-500-1499.mcap"'
    data = unchunk(body)
    output = tmp_path / "window.mcap"
    words = ["--from", "500", "--to", "1499", "--output", str(output)]
    assert recorded.log("cut", "--dir", recorded.folder, *words).returncode == 0
    assert data == output.read_bytes()
    assert cycles(data) == list(range(500, 1500))
    assert get(server, f"?session={SESSION}&from=500&to=1499", "HEAD")[::2] == (200, b"")
    # Half of it is there.
    assert cycles(unchunk(get(server, f"?session={SESSION}&to=5000&from=2990")[2])) == list(
        range(2990, 3000)
    )


@pytest.mark.parametrize(
    "query",
    [
        "",
        "?",
        "?session=4711",
        "?session=4711&from=5",
        "?session=4711&from=5&to=4",
        "?session=0&from=5&to=6",
        "?session=4711&from=5&to=6&to=7",
        "?session=4711&from=5&to=6&output=/tmp/x",
        "?session=4711&from=-5&to=6",
        "?session=4711&from=%35x&to=6",
        "?session=4711&from=5&to=4194309",
        "?session=--help&from=5&to=6",
        "?session=4711&from=5&to=6" + "0" * 90,
        "?session=4711&from=5&to=6&" + "x" * 90,
    ],
)
def test_another_query_starts_nothing(recorded: Bench, server: Web, query: str) -> None:
    before = sorted(path.name for path in recorded.folder.iterdir())
    status, _, body = get(server, query)
    assert status == 400
    assert body.startswith(b"the query is not session=N&from=CYCLE&to=CYCLE")
    assert sorted(path.name for path in recorded.folder.iterdir()) == before
    assert "ecdaq: log" not in server.stop()


@pytest.mark.parametrize("query", ["?session=4711&from=5&to=6%00--output", "?" + "&" * 200])
def test_a_query_that_is_no_text_is_not_answered(recorded: Bench, server: Web, query: str) -> None:
    with pytest.raises(IndexError):  # the connection is ended
        get(server, query)
    assert get(server, f"?session={SESSION}&from=5&to=6")[0] == 200


def test_what_is_not_recorded_is_not_found(recorded: Bench, server: Web) -> None:
    assert get(server, f"?session={SESSION}&from=3000&to=3100")[0] == 404
    assert get(server, f"?session={SESSION + 1}&from=0&to=100")[0] == 404
    assert "there is no such cycle" in server.stop()


def test_a_window_that_is_damaged_does_not_look_complete(recorded: Bench, server: Web) -> None:
    [path] = recorded.files()
    data = bytearray(path.read_bytes())
    for tenth in range(1, 10):  # one of them at least is in a chunk
        data[len(data) * tenth // 10] ^= 0xFF
    path.write_bytes(data)
    status, _, body = get(server, f"?session={SESSION}&from=0&to=2999")
    assert status == 200
    with pytest.raises(ValueError, match="invalid literal"):  # its last chunk is not there
        unchunk(body)
    assert path.name in server.stop()


def test_the_scope_saves_what_it_shows_as_a_recording(
    recorded: Bench, server: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(server, "#scope?c=piccolo0.adc&w=1")
    note = "document.querySelector('#scope-note').textContent"
    browser.wait_for(
        "(() => { const pause = document.querySelector('#scope-pause');"
        " if (pause.getAttribute('aria-pressed') === 'false') { pause.click(); }"
        f" return {note}.startsWith('paused'); }})()"
    )
    browser.value(
        "HTMLAnchorElement.prototype.click = function () {"
        " window.saved = [this.getAttribute('href'), this.download]; };"
        " { const s = document.querySelector('#scope-save'); s.value = 'mcap';"
        " s.dispatchEvent(new Event('input')); }"
    )
    browser.wait_for("window.saved !== undefined")
    href, name = browser.value("saved")
    status, _, body = http(server.port, f"GET /{href}")
    assert status == 200
    found = cycles(unchunk(body))
    assert name == f"ecdaq-{found[0]}-{found[-1]}.mcap"
    assert found == list(range(found[0], found[-1] + 1))
    assert len(found) == 1000
    assert browser.problems() == []


def test_a_live_window_waits_until_its_newest_samples_are_recorded(
    bench: Bench,
    make_web: Callable[..., Web],
    make_browser: Callable[..., Browser],
    tmp_path: Path,
) -> None:
    """With chunks of 2 s: after the 2 s of the default the end would not always be there."""
    config = tmp_path / "slow.yaml"
    config.write_text("record:\n  chunk_period: 2s\n  sync_period: 2s\n")
    bench.produce("--cycles", "1000000", "--pace")
    bench.record("--config", str(config))
    server = make_web(config, record_dir=str(bench.folder))
    browser = make_browser(server, "#scope?c=piccolo0.adc&w=1")
    browser.wait_for("document.querySelector('#scope-rows td')?.textContent === 'piccolo0.adc'")
    browser.value("new Promise((done) => setTimeout(done, 1500))")  # of live samples
    browser.value(
        "window.asked = performance.now(); HTMLAnchorElement.prototype.click = function () {"
        " const waited = performance.now() - asked;"
        " fetch(this.getAttribute('href')).then((r) => r.arrayBuffer()).then((data) => {"
        " window.saved = [this.download, waited, Array.from(new Uint8Array(data))]; }); };"
        " { const s = document.querySelector('#scope-save'); s.value = 'mcap';"
        " s.dispatchEvent(new Event('input')); }"
    )
    browser.wait_for("window.saved !== undefined", 60)
    name, waited_ms, data = browser.value("saved")
    assert waited_ms >= 4500
    found = cycles(bytes(data))
    assert len(found) == 1000
    assert name == f"ecdaq-{found[0]}-{found[-1]}.mcap"
