# SPDX-License-Identifier: MIT
"""Programs on the libraries of others: built once and kept, in ~/.cache/ecdaq/foreign-NAME-HASH/.

One that cannot be built here raises Unavailable with the reason.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

BUILD_SECONDS = 1200


class Unavailable(Exception):  # noqa: N818 - not an error: a reason
    """Why a foreign program cannot be built here."""


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
    """What it says of its version."""
    if shutil.which(program) is None:
        raise Unavailable(f"{program} is missing (app/tools/packages.txt: {package})")
    return run(program, "--version", cwd=Path("/"))


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


def build_cargo(folder: Path, out: Path, program: str, *options: str) -> Path:
    """Versions and checksums are those of Cargo.lock.in in @folder; the registry is that of the
    machine."""
    source = out / "source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(folder, source)
    with tempfile.TemporaryDirectory() as asking:
        registry = registry_id(Path(asking))
    lock = (source / "Cargo.lock.in").read_text().replace("@registry@", registry)
    (source / "Cargo.lock").write_text(lock)
    # A hundred crates, which need not be built again where only our source has changed.
    target = cache() / "foreign-rust-target"
    env = {"CARGO_TARGET_DIR": str(target)}
    run("cargo", "build", "--locked", "--quiet", *options, cwd=source, env=env)
    profile = "release" if "--release" in options else "debug"
    shutil.copy2(target / profile / program, out)
    return out / program


def kept(
    folder: Path,
    program: str,
    compiler: str,
    build: Callable[[Path], Path],
    only: Sequence[str] = (),
) -> Path:
    """The @program of the sources in @folder (or @only these); built if they were not yet, by this
    compiler."""
    digest = hashlib.sha256(compiler.encode())
    sources = [folder / name for name in only] or folder.rglob("*")
    for path in sorted(p for p in sources if p.is_file()):
        name = path.relative_to(folder.parent).as_posix()
        digest.update(name.encode() + b"\0" + path.read_bytes())
    place = cache() / f"foreign-{folder.name}-{digest.hexdigest()[:12]}"
    built = place / program
    place.mkdir(parents=True, exist_ok=True)
    with (place / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not built.exists():
            work = place / "work"
            work.mkdir(exist_ok=True)
            build(work).replace(built)
            shutil.rmtree(work)
    return built
