# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from segment import BIN, Segment


@pytest.fixture
def make_segment(tmp_path: Path) -> Iterator[Callable[..., Segment]]:
    """Makes segments and ends what they started."""
    if not (BIN / "ecdaqd").exists():
        pytest.fail(f"no programs in {BIN}: run ./build.sh build")
    made: list[Segment] = []

    def make(**arguments: object) -> Segment:
        folder = tmp_path / f"segment{len(made)}"
        folder.mkdir()
        try:
            segment = Segment(folder, **arguments)  # type: ignore[arg-type]
        except PermissionError as why:
            pytest.skip(f"not permitted: {why}")
        made.append(segment)
        return segment

    yield make
    for segment in made:
        segment.close()
