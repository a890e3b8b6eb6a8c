# SPDX-License-Identifier: MIT
from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bench import BUILD, KIT, Bench, live

sys.path.insert(0, str(KIT))


@pytest.fixture
def make_bench(tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    """Makes benches and ends what they started."""
    if not (live.BIN / "ecdaq-dds").exists() or not (BUILD / "tests/dds/dds_subscriber").exists():
        pytest.fail("ecdaq-dds is not built: it needs cyclonedds-dev and cyclonedds-tools")
    made: list[Bench] = []

    def make(**settings: str) -> Bench:
        folder = tmp_path / f"bench{len(made)}"
        folder.mkdir()
        try:
            bench = Bench(folder, settings)
        except PermissionError as why:
            pytest.skip(f"not permitted: {why}")
        made.append(bench)
        return bench

    yield make
    for bench in made:
        bench.close()
