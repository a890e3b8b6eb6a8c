# SPDX-License-Identifier: MIT
"""From a root file system to the files of an image: the parts for make-disk.sh, and the documents
that belong to it (package list, bill of materials, checksums)."""

from __future__ import annotations

import hashlib
import os
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path

import sbom
import wks

NAMESPACE = uuid.UUID("6ba7b811-9dad-11d1-80b4-00c04fd430c8")


@dataclass(frozen=True)
class Inputs:
    """What an image is made of; all paths are on the building machine."""

    work: str
    rootfs: str
    wks: str
    name: str
    boot_files: list[str]
    version: str
    epoch: int


def _fill_boot(inputs: Inputs, out: Path, boot: Path) -> None:
    """The boot partition: IMAGE_BOOT_FILES ("source;target"; bare names are beside the image)."""
    for entry in inputs.boot_files:
        source, _, target = entry.partition(";")
        found = out / source
        if not found.exists():
            raise FileNotFoundError(f"IMAGE_BOOT_FILES: there is no {found}")
        place = boot / (target or found.name)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(found, place)
    for path in [boot, *boot.rglob("*")]:
        os.utime(path, (inputs.epoch, inputs.epoch))


def _plan(inputs: Inputs, layout: wks.Layout) -> str:
    """What make-disk.sh reads: one shell-safe line for the disk, one for each partition."""
    identity = layout.identity or str(uuid.uuid5(NAMESPACE, inputs.name))
    lines = [f"disk {inputs.name} {layout.table} {identity}"]
    for part in layout.partitions:
        given = part.uuid or str(uuid.uuid5(NAMESPACE, f"{inputs.name}/{part.label}"))
        lines.append(
            f"part {part.source or 'empty'} {part.fstype or 'none'} {part.label}"
            f" {part.size_bytes} {given} {part.mkfs_options}".rstrip()
        )
    return "\n".join(lines) + "\n"


def prepare(inputs: Inputs) -> None:
    """Lay ready in work/disk what make-disk.sh puts together; papers go to work/out."""
    work = Path(inputs.work)
    out = work / "out"
    tar = work / "tar" / "rootfs.tar"
    layout = wks.parse(Path(inputs.wks))
    boot = work / "disk" / "boot"
    boot.mkdir(parents=True)
    _fill_boot(inputs, out, boot)
    (work / "disk" / "plan").write_text(_plan(inputs, layout))
    packages = sbom.installed_packages(Path(inputs.rootfs))
    (out / f"{inputs.name}.manifest").write_text(sbom.manifest(packages))
    (out / f"{inputs.name}.spdx.json").write_text(
        sbom.spdx(packages, inputs.name, inputs.version, inputs.epoch)
    )
    shutil.copy(
        next(Path(inputs.rootfs).glob("boot/config-*")), out / f"{inputs.name}.kernel-config"
    )
    with tar.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    (out / f"{inputs.name}.rootfs.sha256").write_text(f"{digest}  rootfs.tar\n")


def finish(work: str, name: str) -> None:
    """Checksums of all that was made."""
    out = Path(work) / "out"
    lines = []
    for path in sorted(p for p in out.iterdir() if p.suffix != ".sha256"):
        with path.open("rb") as stream:
            lines.append(f"{hashlib.file_digest(stream, 'sha256').hexdigest()}  {path.name}\n")
    (out / f"{name}.sha256").write_text("".join(lines))
