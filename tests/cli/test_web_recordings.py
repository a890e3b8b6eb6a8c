# SPDX-License-Identifier: MIT
"""Recordings as ecdaq-web lists and serves them."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ecdaq import ROOT
from recording import Bench, wait_until
from web_bench import Web
from web_client import Page, http, unchunk

KEYS = {"name", "bytes", "state", "kept", "start_ms", "seconds", "cycles", "missing"}
HUGE_BYTES = 1 << 30


@pytest.fixture
def recorded(bench: Bench) -> Path:
    """A finished recording of 3000 cycles, 100 of which are missing."""
    bench.produce("--cycles", "3000", "--wait", "--skip", "1500:100").communicate("", timeout=60)
    bench.record_all()
    [path] = bench.files()
    return path


@pytest.fixture
def server(bench: Bench, make_web: Callable[..., Web]) -> Web:
    return make_web(record_dir=str(bench.folder))


def listed(page: Page, is_wanted: Callable[[list[dict[str, Any]]], bool]) -> dict[str, Any]:
    page.ask(op="recordings", on=True)
    return page.wait_for("recordings", lambda m: is_wanted(m["recordings"]))


def test_the_list_has_what_the_files_say_of_themselves(
    bench: Bench, recorded: Path, server: Web
) -> None:
    page = Page(server.port)
    message = listed(page, lambda rows: bool(rows) and "cycles" in rows[0])
    [row] = message["recordings"]
    assert set(row) == KEYS
    assert (row["name"], row["bytes"]) == (recorded.name, recorded.stat().st_size)
    assert (row["state"], row["kept"], row["missing"]) == ("finished", False, 100)
    assert row["cycles"] == 2900
    assert row["seconds"] == pytest.approx(3, abs=0.01)
    info = bench.log("info", recorded, "--json").stdout
    start_ns = int(re.findall(r'"start_ns":(\d+)', info)[-1])
    assert row["start_ms"] == pytest.approx(start_ns / 1e6, abs=0.01)
    assert (message["dir"], message["error"], message["total"]) == (str(bench.folder), "", 1)


def test_each_state_of_a_file_is_listed_the_newest_first(
    bench: Bench, recorded: Path, server: Web
) -> None:
    folder = bench.folder
    data = recorded.read_bytes()
    stem = recorded.name.removesuffix("000001.mcap")
    assert stem != recorded.name
    (folder / f"{stem}000001.keep").touch()
    (folder / f"{stem}000002.mcap").write_bytes(data[: len(data) // 2])
    (folder / f"{stem}000003.mcap").write_bytes(data[:-30] + bytes(22) + data[-8:])
    (folder / f"{stem}000004.damaged").write_bytes(data[:1000])
    (folder / f"{stem}000005.part").write_bytes(data[: len(data) // 2])
    (folder / f"{stem}000006.mcap").symlink_to("/etc/hostname")
    (folder / "notes.txt").touch()
    message = listed(Page(server.port), lambda rows: len(rows) == 5 and "cycles" in rows[4])
    states = {row["name"].removeprefix(stem): row["state"] for row in message["recordings"]}
    assert states == {
        "000005.part": "unfinished",
        "000004.damaged": "damaged",
        "000003.mcap": "unreadable",
        "000002.mcap": "damaged",
        "000001.mcap": "finished",
    }
    assert list(states) == sorted(states, reverse=True)
    assert [row["kept"] for row in message["recordings"]] == [False] * 4 + [True]
    # The name has the start where the file has no end.
    assert all(row["start_ms"] > 0 for row in message["recordings"])


def test_a_recording_that_goes_on_is_listed_and_its_end_too(bench: Bench, server: Web) -> None:
    page = Page(server.port)
    bench.produce("--cycles", "1000000", "--pace")
    recorder = bench.record()
    message = listed(page, lambda rows: [r["state"] for r in rows] == ["recording"])
    name = message["recordings"][0]["name"]
    assert name.endswith(".part")
    recorder.terminate()
    recorder.communicate(timeout=60)
    rows = listed(page, lambda rows: [r["state"] for r in rows] == ["finished"])["recordings"]
    assert rows[0]["name"] == name.replace(".part", ".mcap")
    assert rows[0]["missing"] == 0


def test_a_folder_that_is_not_there_has_its_reason(make_web: Callable[..., Web]) -> None:
    web = make_web(record_dir="/nowhere/at/all")
    message = listed(Page(web.port), lambda rows: rows == [])
    assert message["error"] == "No such file or directory"


def test_nobody_who_looks_costs_no_reading_of_the_folder(
    bench: Bench, recorded: Path, server: Web
) -> None:
    page = Page(server.port)
    page.wait_for("state")
    page.wait_for("state")
    assert "recordings" not in page.newest


def test_a_recording_is_the_bytes_of_its_file(recorded: Path, server: Web) -> None:
    data = recorded.read_bytes()
    status, headers, body = http(server.port, f"GET /recordings/{recorded.name}")
    assert (status, body) == (200, data)
    assert headers["content-length"] == str(len(data))
    assert headers["accept-ranges"] == "bytes"
    assert headers["content-disposition"] == f'attachment; filename="{recorded.name}"'
    assert headers["cross-origin-resource-policy"] == "same-origin"
    status, headers, body = http(server.port, f"HEAD /recordings/{recorded.name}")
    assert (status, headers["content-length"], body) == (200, str(len(data)), b"")


@pytest.mark.parametrize(
    ("asked", "first", "end"),
    [("0-0", 0, 1), ("100-199", 100, 200), ("100-", 100, None), ("-100", -100, None)],
)
def test_a_part_of_a_recording(
    recorded: Path, server: Web, asked: str, first: int, end: int | None
) -> None:
    data = recorded.read_bytes()
    path = f"GET /recordings/{recorded.name}"
    status, headers, body = http(server.port, path, Range=f"bytes={asked}")
    assert (status, body) == (206, data[first:end])
    start = first % len(data)
    assert headers["content-range"] == f"bytes {start}-{start + len(body) - 1}/{len(data)}"
    status, headers, body = http(server.port, path, Range=f"bytes={len(data)}-")
    assert (status, headers["content-range"], body) == (416, f"bytes */{len(data)}", b"")
    # Of a file that has changed since it is all of it.
    fields = {"Range": f"bytes={asked}", "If-Range": '"another"'}
    assert http(server.port, path, **fields)[0] == 200
    fields["If-Range"] = headers["etag"]
    assert http(server.port, path, **fields)[0] == 206


KIT = """
import sys
import ecdaq
import numpy as np
found, expected = (ecdaq.read(place).table for place in sys.argv[1:])
assert len(expected.gaps) == 1, expected.gaps
assert list(found.cycle) == list(expected.cycle) and found.gaps == expected.gaps
for name, column in expected.columns.items():
    assert np.array_equal(found.columns[name].as_float(), column.as_float(), equal_nan=True), name
"""


def test_the_python_kit_reads_a_recording_from_its_address(recorded: Path, server: Web) -> None:
    url = f"http://127.0.0.1:{server.port}/recordings/{recorded.name}"
    done = subprocess.run(
        [sys.executable, "-c", KIT, url, recorded],
        env=os.environ | {"PYTHONPATH": str(ROOT / "app" / "services" / "publish" / "python")},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_a_table_is_what_the_command_line_exports(
    bench: Bench, recorded: Path, server: Web
) -> None:
    path = f"/recordings/{recorded.stem}.csv"
    status, headers, body = http(server.port, f"GET {path}")
    assert (status, headers["content-type"]) == (200, "text/csv; charset=utf-8")
    assert headers["content-disposition"] == f'attachment; filename="{recorded.stem}.csv"'
    assert unchunk(body).decode() == bench.log("export", recorded).stdout
    assert http(server.port, f"HEAD {path}")[::2] == (200, b"")


def test_a_table_that_breaks_off_does_not_look_complete(
    bench: Bench, recorded: Path, server: Web
) -> None:
    data = bytearray(recorded.read_bytes())
    data[len(data) * 2 // 3] ^= 0xFF
    recorded.write_bytes(data)
    status, _, body = http(server.port, f"GET /recordings/{recorded.stem}.csv")
    assert status == 200
    assert not body.endswith(b"0\r\n\r\n")
    recorded.write_bytes(b"no recording")
    status, _, body = http(server.port, f"GET /recordings/{recorded.stem}.csv")
    assert (status, body) == (500, b"the export failed: see the log of ecdaq-web\n")
    assert "not an MCAP file" in server.stop()


@pytest.mark.parametrize(
    "name",
    [
        "",
        "../secret-1.mcap",
        "%2e%2e/secret-1.mcap",
        "ecdaq-/../../secret-1.mcap",
        "ecdaq-%2f..%2f..%2fsecret-1.mcap",
        "ecdaq-x-2.mcap",  # a link
        "ecdaq-x-3.mcap",  # a folder
        "ecdaq-x-4.mcap",  # a FIFO
        "ecdaq-x-2.csv",
        "ecdaq-x-9.mcap",  # nothing
        "ecdaq-x-9.csv",
        "state",
        ".lock",
        "ecdaq-x-1.keep",
        "ecdaq-" + "x" * 200 + "-1.mcap",
        "ecdaq-" + "x" * 200 + "-1.csv",
    ],
)
def test_nothing_but_recordings_of_that_folder_is_served(
    bench: Bench, server: Web, name: str
) -> None:
    (bench.folder.parent / "secret-1.mcap").write_text("secret")
    (bench.folder / "ecdaq-x-1.keep").write_text("secret")
    (bench.folder / "state").write_text("secret")
    (bench.folder / "ecdaq-x-2.mcap").symlink_to(bench.folder.parent / "secret-1.mcap")
    (bench.folder / "ecdaq-x-3.mcap").mkdir()
    os.mkfifo(bench.folder / "ecdaq-x-4.mcap")
    status, _, body = http(server.port, f"GET /recordings/{name}")
    assert status in (403, 404)
    assert b"secret" not in body


def test_a_foreign_host_name_gets_no_recording(recorded: Path, server: Web) -> None:
    for name in (recorded.name, f"{recorded.stem}.csv"):
        assert http(server.port, f"GET /recordings/{name}", Host="evil.example")[0] == 403


def children(web: Web) -> list[str]:
    found = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(web.process.pid)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return found.stdout.split()


def begin(web: Web, path: str) -> socket.socket:
    """A request whose answer is not read but for its head."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    sock.settimeout(20)
    sock.connect(("127.0.0.1", web.port))
    sock.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{web.port}\r\n\r\n".encode())
    assert b" 200 " in sock.recv(1024)
    return sock


def long_recording(bench: Bench) -> Path:
    bench.produce("--cycles", "60000", "--wait").communicate("", timeout=60)
    bench.record_all()
    return bench.files()[0]


def test_exports_are_few_and_end_with_their_client(bench: Bench, server: Web) -> None:
    path = f"/recordings/{long_recording(bench).stem}.csv"
    stalled = [begin(server, path), begin(server, path)]
    assert len(children(server)) == 2
    status, _, body = http(server.port, f"GET {path}")
    assert (status, body.startswith(b"too many")) == (503, True)
    Page(server.port).wait_for("state")
    stalled.pop().close()
    wait_until("one export less", lambda: len(children(server)) == 1)
    assert http(server.port, f"GET {path}")[0] == 200
    server.stop()
    with pytest.raises((ConnectionError, EOFError)):
        drain(stalled[0])


def drain(sock: socket.socket) -> None:
    """Read to the end; an end without the last chunk is one that came too early."""
    data = b""
    while part := sock.recv(1 << 16):
        data = (data + part)[-5:]
    if data != b"0\r\n\r\n":
        raise EOFError


def test_downloads_do_not_delay_the_samples_of_others(bench: Bench, server: Web) -> None:
    """A large file and a table, both read as fast as they come, beside the state of a page."""
    stem = long_recording(bench).stem
    with (bench.folder / "ecdaq-x-2.mcap").open("wb") as file:
        file.truncate(HUGE_BYTES)
    page = Page(server.port)
    page.wait_for("state")
    ended: list[int] = []

    def download(path: str) -> None:
        sock = begin(server, path)
        while part := sock.recv(1 << 20):
            if part.endswith(b"0\r\n\r\n"):
                break
        ended.append(1)
        sock.close()

    paths = (f"/recordings/{stem}.csv", "/recordings/ecdaq-x-2.mcap")
    threads = [threading.Thread(target=download, args=(p,), daemon=True) for p in paths]
    for thread in threads:
        thread.start()
    states = 0
    while threads[0].is_alive():
        page.wait_for("state")
        states += 1
    assert states > 0
    assert ended
