# SPDX-License-Identifier: MIT
from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from made import KIT, make

sys.path.insert(0, str(KIT))


@pytest.fixture
def recorded(tmp_path: Path) -> Callable[..., Path]:
    """Records what test_ring_producer makes of the options; the folder."""

    def record(
        *options: str, settings: tuple[str, ...] = (), folder: str = "records", clock: str = ""
    ) -> Path:
        return make(tmp_path / folder, options, settings, clock)

    return record


@pytest.fixture(scope="session")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 3 s: events, a gap of 7 cycles at 300, every 50th sample of slave 1 bad."""
    options = ("--cycles", "3000", "--events", "3", "--bad", "50", "--skip", "300:7")
    return make(tmp_path_factory.mktemp("sample") / "records", options)
