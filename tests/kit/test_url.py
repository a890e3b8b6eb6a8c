# SPDX-License-Identifier: MIT
"""ecdaq.read() of a URL, against a local server."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import ecdaq
import numpy as np
import pytest
from made import files, make


class Server(ThreadingHTTPServer):
    """Serves @content with Range requests, and counts the bytes it sends."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.content = b""
        self.sent = 0
        self.has_ranges = True
        self.url = f"http://127.0.0.1:{self.server_address[1]}/x.mcap"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        content = self.server.content
        asked = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"])
        assert asked
        if self.path != "/x.mcap":
            self.send_error(404)
            return
        first, last = int(asked[1]), min(int(asked[2]), len(content) - 1)
        body = content[first : last + 1] if self.server.has_ranges else content
        self.send_response(206 if self.server.has_ranges else 200)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Content-Range", f"bytes {first}-{last}/{len(content)}")
        self.end_headers()
        self.server.sent += len(body)
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server()
    thread = threading.Thread(target=made.serve_forever)
    thread.start()
    yield made
    made.shutdown()
    thread.join()
    made.server_close()


def test_a_url_gives_what_the_file_gives(server: Server, sample: Path) -> None:
    (path,) = files(sample)
    server.content = path.read_bytes()
    found, expected = ecdaq.read(server.url).table, ecdaq.read(path).table
    assert np.array_equal(found.cycle, expected.cycle)
    for name, column in expected.columns.items():
        assert np.array_equal(found.columns[name].valid, column.valid)
        assert np.array_equal(found.columns[name].as_float(), column.as_float(), equal_nan=True)
    assert found.gaps == expected.gaps


def test_only_what_is_selected_is_transferred(server: Server, long_sample: Path) -> None:
    server.content = long_sample.read_bytes()
    size = len(server.content)
    assert size > 5_000_000
    recording = ecdaq.read(server.url)
    assert server.sent == 0
    assert len(recording.channels) == 7
    assert server.sent < size / 10
    server.sent = 0
    table = ecdaq.read(server.url, "piccolo0.adc", cycles=(20_000, 20_100)).table
    assert table.cycle.tolist() == list(range(20_000, 20_101))
    assert server.sent < size / 3


@pytest.fixture(scope="module")
def long_sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("long") / "records"
    make(folder, ("--cycles", "30000"), ("record.compression=0",))
    return files(folder)[0]


def test_what_the_server_refuses_is_reported_with_the_url(server: Server, sample: Path) -> None:
    (path,) = files(sample)
    server.content = path.read_bytes()
    missing = server.url.replace("/x", "/y")
    with pytest.raises(ecdaq.RecordingError, match=f"{missing}: HTTP 404"):
        _ = ecdaq.read(missing).channels
    server.has_ranges = False
    with pytest.raises(ecdaq.RecordingError, match="ignores Range requests"):
        _ = ecdaq.read(server.url).channels
    with pytest.raises(ecdaq.RecordingError, match="Connection refused"):
        _ = ecdaq.read("http://127.0.0.1:9/x.mcap").channels
    server.has_ranges = True
    recording = ecdaq.read(server.url)
    assert recording.channels
    server.content += b"more"
    with pytest.raises(ecdaq.RecordingError, match="changed on the server"):
        _ = recording.table
