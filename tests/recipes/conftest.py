# SPDX-License-Identifier: MIT
"""Puts the runner and the layers' own modules on the path of the tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[2]
sys.path[:0] = [
    str(Path(__file__).parent),
    str(TOP / "app" / "tools" / "image"),
    str(TOP / "layers" / "meta-local" / "lib"),
]
from metadata import Metadata  # noqa: E402 - found on the path set above

MACHINES = sorted(p.stem for p in (TOP / "layers/meta-ecdaq/conf/machine").glob("*.conf"))


@pytest.fixture(scope="session", params=MACHINES)
def metadata(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Metadata:
    """Every recipe, parsed by BitBake for one machine."""
    build = tmp_path_factory.mktemp(f"build-{request.param}")
    return Metadata(
        TOP,
        build,
        {
            "MACHINE": request.param,
            "DISTRO": "ecdaq",
            "TMPDIR": str(build / "tmp"),
            "DEPLOY_DIR_IMAGE": str(build / "images"),
            "ECDAQ_TOP": str(TOP),
        },
    )
