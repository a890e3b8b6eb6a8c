# SPDX-License-Identifier: MIT
"""Neither ecdaq-web nor its page grows while it is open and clients come and go."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from browser import find
from recording import Bench
from web_bench import Web
from web_hour import HEAD, HEAP_BYTES, NODES, SERVER_BYTES, Look, grown, hold_open

SECONDS = float(os.environ.get("ECDAQ_WEB_HOUR_SECONDS", "15"))
# The allocator of AddressSanitizer keeps what was freed: its LeakSanitizer looks for the rest.
IS_SANITIZED = os.environ.get("ECDAQ_FLAVOUR", "release") != "release"
OF_ALLOCATOR = ("server_bytes",) if IS_SANITIZED else ()
FIRST = Look(30, 3000, 300, 13, 12_000_000, 1_400_000, 9280, 571)


def test_an_hour_open_leaks_nothing(
    bench: Bench, make_web: Callable[..., Web], tmp_path: Path
) -> None:
    """Some seconds here, in which as many clients come as in weeks; ECDAQ_WEB_HOUR_SECONDS=3600."""
    bench.produce("--cycles", "1000000000", "--pace", "--events", "600")
    web = make_web(**{"record.dir": str(bench.folder)})
    looks = hold_open(web, tmp_path, SECONDS)
    text = "\n".join([HEAD, *(look.line() for look in looks)])
    print(text)
    assert looks[-1].clients - looks[0].clients > 100, text
    assert find() is None or looks[-1].pictures > looks[0].pictures + 20, text
    # What is compared was read.
    assert min(look.descriptors for look in looks) > 5, text
    assert min(look.server_bytes for look in looks) > 1_000_000, text
    if find() is not None:
        assert min(look.heap_bytes for look in looks) > 100_000, text
        assert min(look.nodes for look in looks) > 1000, text
        assert min(look.listeners for look in looks) > 100, text
    assert [line for line in grown(looks) if not line.startswith(OF_ALLOCATOR)] == [], text


@pytest.mark.parametrize(
    ("more", "what"),
    [
        ({}, []),
        ({"heap_bytes": HEAP_BYTES, "server_bytes": SERVER_BYTES, "nodes": NODES}, []),
        ({"descriptors": 1}, ["descriptors"]),
        ({"server_bytes": SERVER_BYTES + 1}, ["server_bytes"]),
        ({"heap_bytes": HEAP_BYTES + 1}, ["heap_bytes"]),
        ({"nodes": NODES + 1, "listeners": 21}, ["nodes", "listeners"]),
    ],
)
def test_what_grows_is_found(more: dict[str, int], what: list[str]) -> None:
    last = dataclasses.replace(
        FIRST, **{name: getattr(FIRST, name) + value for name, value in more.items()}
    )
    assert [line.split(":")[0] for line in grown([FIRST, FIRST, last])] == what
