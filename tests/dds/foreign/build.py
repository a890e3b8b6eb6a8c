# SPDX-License-Identifier: MIT
"""Build the foreign subscribers once and keep them: ~/.cache/ecdaq/foreign-HASH/.

    python tests/dds/foreign/build.py     # builds both, prints where they are

A program that cannot be built here raises Unavailable with the reason. The hash is that of the
sources and of the compiler.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
BUILD_SECONDS = 1200


class Unavailable(Exception):  # noqa: N818 - not an error: a reason
    """Why a foreign subscriber cannot be built here."""


def cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "ecdaq"


def run(*command: str | Path, cwd: Path, env: dict[str, str] | None = None) -> str:
    """Run a step of a build; its output. Unavailable with the last lines of a failed one."""
    ended = subprocess.run(
        command, cwd=cwd, env=os.environ | (env or {}), text=True, capture_output=True,
        timeout=BUILD_SECONDS, check=False,
    )  # fmt: skip
    if ended.returncode != 0:
        last = "\n".join((ended.stdout + ended.stderr).strip().splitlines()[-15:])
        raise Unavailable(f"{' '.join(map(str, command[:3]))}: {last}")
    return ended.stdout


def need(program: str, package: str) -> str:
    if shutil.which(program) is None:
        raise Unavailable(f"{program} is missing (app/tools/packages.txt: {package})")
    return run(program, "--version", cwd=HERE)


def build_fast(out: Path) -> Path:
    run("cmake", "-S", HERE / "fastdds", "-B", out, "-G", "Ninja", cwd=HERE)
    run("cmake", "--build", out, cwd=HERE)
    return out / "fast_subscriber"


def registry_id(folder: Path) -> str:
    """How cargo, as it is set up on this machine, calls its registry in a lock file."""
    (folder / "src").mkdir()
    (folder / "src" / "lib.rs").touch()
    (folder / "Cargo.toml").write_text(
        '[package]\nname = "asked"\nversion = "0.0.0"\nedition = "2021"\n'
        '[dependencies]\nlibc = "0.2"\n'
    )
    run("cargo", "generate-lockfile", cwd=folder)
    found = re.search(r'^source = "(.*)"$', (folder / "Cargo.lock").read_text(), re.MULTILINE)
    if found is None:
        raise Unavailable("cargo names no registry")
    return found.group(1)


def build_rust(out: Path) -> Path:
    """Versions and checksums are Cargo.lock.in's; the registry is that of the machine."""
    source = out / "source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(HERE / "rust", source)
    with tempfile.TemporaryDirectory() as folder:
        registry = registry_id(Path(folder))
    lock = (source / "Cargo.lock.in").read_text().replace("@registry@", registry)
    (source / "Cargo.lock").write_text(lock)
    # A hundred crates, which need not be built again where only our source has changed.
    target = cache() / "foreign-rust-target"
    env = {"CARGO_TARGET_DIR": str(target)}
    run("cargo", "build", "--locked", "--quiet", cwd=source, env=env)
    shutil.copy2(target / "debug" / "rust_subscriber", out)
    return out / "rust_subscriber"


def kept(name: str, compiler: str, build: Callable[[Path], Path]) -> Path:
    """The program @name; built if these sources were not yet, by this compiler."""
    digest = hashlib.sha256(compiler.encode())
    for path in sorted(p for p in (HERE / name).rglob("*") if p.is_file()):
        digest.update(path.relative_to(HERE).as_posix().encode() + b"\0" + path.read_bytes())
    folder = cache() / f"foreign-{name}-{digest.hexdigest()[:12]}"
    program = folder / f"{name}_subscriber"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not program.exists():
            work = folder / "work"
            made = build(work)
            made.replace(program)
            shutil.rmtree(work)
    return program


def fast_subscriber() -> Path:
    compiler = need("c++", "g++") + need("cmake", "cmake")
    return kept("fastdds", compiler, build_fast)


def rust_subscriber() -> Path:
    return kept("rust", need("cargo", "cargo"), build_rust)


def main() -> int:
    try:
        print(fast_subscriber(), rust_subscriber(), sep="\n")
    except Unavailable as why:
        print(f"build.py: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
