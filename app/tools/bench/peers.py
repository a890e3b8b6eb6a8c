# SPDX-License-Identifier: MIT
"""The masters and floors of `./build.sh bench peers`: how each is built and started.

Each loop takes the arguments of tests/bench/loops/loop.h, prints "slaves N", "op NS" when its
slaves have reached OP (CLOCK_MONOTONIC), "free ANSWERS NS" after its free run, and writes a record
of each cycle.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tarfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from foreign import Unavailable, build_cargo, cache, kept, need, run

ROOT = Path(__file__).resolve().parents[3]
HERE = ROOT / "tests" / "bench"
BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))
BIN = Path(os.environ.get("ECDAQ_BIN_DIR", ROOT / "build" / "stage" / "bin"))
PROGRAMS = BUILD / "tests" / "bench"
PRIORITY = 80


@dataclass(frozen=True)
class Peer:
    """One master beside ecdaq."""

    name: str
    # Its command without the arguments of the loop; Unavailable if it cannot take part.
    command: Callable[[], list[str]]
    # How its instructions are counted: a function that callgrind counts, "" for the whole process.
    counted: str = ""


# --- SOEM ---


def soem_archive() -> Path:
    lock = (ROOT / "app" / "third_party" / "soem.lock").read_text()
    found = re.search(r"^file = (.*)$", lock, re.MULTILINE)
    given = os.environ.get("ECDAQ_SOEM_ARCHIVE")
    path = Path(given) if given else cache() / (found[1] if found else "")
    if not path.is_file():
        raise Unavailable(f"{path}: no such archive (app/third_party/fetch-soem.sh fetches it)")
    return path


def build_soem(out: Path) -> Path:
    """With SOEM's own driver of the NIC, and without our patches."""
    with tarfile.open(soem_archive()) as archive:
        archive.extractall(out, filter="data")
    (top,) = out.glob("pysoem-*/soem")
    folders = [top / "soem", top / "osal", top / "osal/linux", top / "oshw/linux"]
    sources = [HERE / "loops" / "soem.c", HERE / "loops" / "loop.c"]
    sources += [path for folder in folders for path in folder.glob("*.c")]
    flags = ["-O2", "-w", "-DEC_VER2", "-D_GNU_SOURCE", "-fno-strict-aliasing"]
    flags += [f"-I{folder}" for folder in [*folders, HERE / "loops"]]
    run("gcc", *flags, "-o", out / "soem_loop", *sources, "-lpthread", cwd=out)
    return out / "soem_loop"


def soem() -> list[str]:
    compiler = need("gcc", "gcc") + (ROOT / "app/third_party/soem.lock").read_text()
    return [str(kept(HERE / "loops", "soem_loop", compiler, build_soem))]


# --- EtherCrab ---


def build_ethercrab(out: Path) -> Path:
    return build_cargo(HERE / "ethercrab", out, "ethercrab_loop", "--release")


def ethercrab() -> list[str]:
    compiler = need("cargo", "cargo-web or cargo")
    return [str(kept(HERE / "ethercrab", "ethercrab_loop", compiler, build_ethercrab))]


# --- Python packages ---


def packages() -> Path:
    """Folder with tests/bench/requirements.txt installed."""

    def install(out: Path) -> Path:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        pip += ["--only-binary", ":all:", "--target", str(out / "packages")]
        run(*pip, "--requirement", HERE / "requirements.txt", cwd=out)
        return out / "packages"

    return kept(HERE, "packages", sys.version + sys.base_prefix, install, ["requirements.txt"])


def pysoem() -> list[str]:
    return [sys.executable, str(HERE / "pysoem_loop.py"), str(packages())]


def kickcat() -> list[str]:
    """Its Python package is looked at; there is no package of the C++ library."""
    look = "import importlib.metadata as m, kickcat; print(m.version('kickcat'), *dir(kickcat.Bus))"
    env = {"PYTHONPATH": str(packages())}
    version, *calls = run(sys.executable, "-c", look, cwd=ROOT, env=env).split()
    clocks = [call for call in calls if re.search(r"dc|sync|clock", call, re.IGNORECASE)]
    if clocks:
        raise Unavailable(f"kickcat {version} has {', '.join(clocks)}, not used here yet")
    raise Unavailable(
        f"its Python package ({version}) has no call for distributed clocks, and the slaves, "
        "FB1111-Piccolos, exchange data with SYNC0 only"
    )


PEERS = (
    Peer("SOEM", soem, counted="loop_counted"),
    Peer("pysoem", pysoem),
    Peer("EtherCrab", ethercrab),
    Peer("KickCAT", kickcat),
)


def cyclictest() -> list[str]:
    path = shutil.which("cyclictest")
    if path is None:
        raise Unavailable("cyclictest is missing (app/tools/packages.txt: rt-tests)")
    return [path]


def program(name: str) -> str:
    """One of our own programs beside the loops."""
    path = PROGRAMS / name
    if not path.exists():
        raise Unavailable(f"{path}: not built (./build.sh build)")
    return str(path)
