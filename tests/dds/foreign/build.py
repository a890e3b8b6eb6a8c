# SPDX-License-Identifier: MIT
"""Build the foreign subscribers once and keep them (app/tools/foreign.py).

python tests/dds/foreign/build.py     # builds both, prints where they are
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "app" / "tools"))

from foreign import Unavailable, build_cargo, kept, need, run

HERE = Path(__file__).resolve().parent


def build_fast(out: Path) -> Path:
    run("cmake", "-S", HERE / "fastdds", "-B", out, "-G", "Ninja", cwd=HERE)
    run("cmake", "--build", out, cwd=HERE)
    return out / "fast_subscriber"


def fast_subscriber() -> Path:
    compiler = need("c++", "g++") + need("cmake", "cmake")
    return kept(HERE / "fastdds", "fastdds_subscriber", compiler, build_fast)


def rust_subscriber() -> Path:
    build = partial(build_cargo, HERE / "rust", program="rust_subscriber")
    return kept(HERE / "rust", "rust_subscriber", need("cargo", "cargo"), build)


def main() -> int:
    try:
        print(fast_subscriber(), rust_subscriber(), sep="\n")
    except Unavailable as why:
        print(f"build.py: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
