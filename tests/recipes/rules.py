# SPDX-License-Identifier: MIT
"""Rules of recipes and layers. Each gives the breaches it finds, one line each."""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path
from typing import Any

from metadata import Recipe

# The order of the style guide; what a recipe does not need it leaves out.
ORDER = (
    *("SUMMARY", "DESCRIPTION", "HOMEPAGE", "SECTION", "LICENSE", "LIC_FILES_CHKSUM"),
    *("DEPENDS", "PV", "PYPI_PACKAGE", "SRC_URI", "SRCREV", "S", "inherit", "PACKAGECONFIG"),
)
LICENSES = {
    "MIT",
    "GPL-2.0-only WITH SOEM-exception",
    "GPL-2.0-only WITH Linux-syscall-note",
    "GPL-2.0-or-later",
}
HOST = re.compile(
    r"(?<![\w.-])(?!www\.)(?:[a-z0-9-]+\.)*(?:debian\.org|pythonhosted\.org|pypi\.org)\b"
)
ASSIGN = re.compile(r"^([A-Z][A-Z0-9_]*)(?::[a-z0-9:-]+)?\s*(=|\?=|\?\?=|:=|\+=|\.=)(.*)$")


def license_fields(recipe: Recipe) -> list[str]:
    """A licence that is known, and a licence text that is the one it was checked against."""
    found = []
    for name in ("SUMMARY", "DESCRIPTION", "SECTION", "LICENSE"):
        if not recipe.value(name):
            found.append(f"{recipe.file}: no {name}")
    for part in recipe.value("LICENSE").split(" AND "):
        if part not in LICENSES:
            found.append(
                f"{recipe.file}: LICENSE '{part}' is not in the list of tests/recipes/rules.py"
            )
    if not recipe.value("LIC_FILES_CHKSUM"):
        found.append(f"{recipe.file}: no LIC_FILES_CHKSUM")
    foreign = "apt://" in recipe.value("SRC_URI") or recipe.value("PYPI_PACKAGE")
    if foreign and not recipe.value("HOMEPAGE"):
        found.append(f"{recipe.file}: no HOMEPAGE, though its source is not ours")
    return found


def license_texts(recipe: Recipe, top: Path) -> list[str]:
    """Texts that are in this tree have the sum that the recipe names."""
    found = []
    for entry in recipe.value("LIC_FILES_CHKSUM").split():
        place, _, checksum = entry.removeprefix("file://").partition(";md5=")
        name = Path(place).name
        for path in (top / name, top / "LICENSES" / name):
            if path.exists() and hashlib.md5(path.read_bytes()).hexdigest() != checksum:
                found.append(f"{recipe.file}: LIC_FILES_CHKSUM of {name} is not that of {path}")
    return found


def pins(recipe: Recipe) -> list[str]:
    """Every source from outside names its exact content; Debian's are those of the suite."""
    found = []
    for uri in recipe.value("SRC_URI").split():
        scheme = uri.partition("://")[0]
        if scheme not in ("file", "apt"):
            found.append(
                f"{recipe.file}: {uri}: only file:// and apt:// (others by a class with a hash)"
            )
    if recipe.value("PYPI_PACKAGE") and not re.fullmatch(
        r"[0-9a-f]{64}", recipe.value("PYPI_SHA256")
    ):
        found.append(f"{recipe.file}: PYPI_SHA256 is no SHA-256")
    return found


def patch_status(name: str, text: str) -> list[str]:
    """A patch says where it is upstream, in words that yocto-check-layer accepts."""
    words = r"Accepted|Backport|Denied|Inactive-Upstream|Inappropriate|Pending|Submitted"
    if re.search(rf"^Upstream-Status: ({words})\b", text, re.MULTILINE):
        return []
    return [f"{name}: no valid Upstream-Status"]


def networking_tasks(recipe: Recipe) -> list[str]:
    """Only fetching uses the network, so that a build can be repeated without it."""
    # An image's packages are fetched where they are installed.
    allowed = {"do_fetch", "do_rootfs_base", "do_rootfs_machine"}
    return [
        f"{recipe.file}: {task} uses the network"
        for task in recipe.tasks
        if recipe.flag(task, "network") and task not in allowed
    ]


def soem_pin(recipe: Recipe, lock: Path) -> list[str]:
    """Both roads build the same SOEM."""
    wanted = dict(re.findall(r"^(\w+) = (.+)$", lock.read_text(), re.MULTILINE))
    pairs = (("package", "PYPI_PACKAGE"), ("version", "PYPI_VERSION"), ("sha256", "PYPI_SHA256"))
    return [
        f"{recipe.file}: {variable} is {recipe.value(variable)}, {lock.name} has {wanted[name]}"
        for name, variable in pairs
        if recipe.value(variable) != wanted[name]
    ]


def soem_patches(recipe: Recipe, folder: Path) -> list[str]:
    """The recipe applies the patches that the tree has: all of them, in order."""
    listed = [Path(u).name for u in recipe.value("SRC_URI").split() if u.endswith(".patch")]
    there = sorted(p.name for p in folder.glob("*.patch"))
    if listed != there:
        return [f"{recipe.file}: SRC_URI applies {listed}, {folder} has {there}"]
    return []


def boot_files(recipe: Recipe) -> list[str]:
    """wic takes a boot file from beside the image, by its bare name, or by its whole path."""
    rootfs = recipe.value("IMAGE_ROOTFS") + "/"
    return [
        f"{recipe.file}: IMAGE_BOOT_FILES: {source} is neither a bare name nor in ${{IMAGE_ROOTFS}}"
        for source in (e.partition(";")[0] for e in recipe.value("IMAGE_BOOT_FILES").split())
        if "/" in source and not source.startswith(rootfs)
    ]


def field_order(name: str, text: str) -> list[str]:
    """Fields are in the order of the style guide; spaces round the sign, double quotes."""
    found = []
    last = -1
    for number, line in enumerate(text.splitlines(), 1):
        match = ASSIGN.match(line)
        word = match[1] if match else line.split(" ", 1)[0]
        if match and not re.match(r"^[A-Z0-9_:a-z-]+ \S+ \"", line):
            found.append(f"{name}:{number}: spaces round the sign, and double quotes")
        if word in ORDER:
            if ORDER.index(word) < last:
                found.append(f"{name}:{number}: {word} comes before {ORDER[last]}")
            last = max(last, ORDER.index(word))
    return found


def no_hosts(name: str, text: str) -> list[str]:
    """Nothing names a package registry: the machine's own configuration does."""
    return [
        f"{name}:{number}: names {match[0]}"
        for number, line in enumerate(text.splitlines(), 1)
        if (match := HOST.search(line)) and not line.lstrip().startswith(("HOMEPAGE", "#"))
    ]


def collections(configuration: Any) -> list[str]:
    """Each collection has pattern, priority, version, series, and dependencies that exist."""
    found = []
    names = (configuration.getVar("BBFILE_COLLECTIONS") or "").split()
    series = set((configuration.getVar("LAYERSERIES_CORENAMES") or "").split())
    for name in names:
        for field in ("BBFILE_PATTERN", "LAYERVERSION", "LAYERSERIES_COMPAT"):
            if not configuration.getVar(f"{field}_{name}"):
                found.append(f"{name}: no {field}_{name}")
        if not (configuration.getVar(f"BBFILE_PRIORITY_{name}") or "").isdigit():
            found.append(f"{name}: BBFILE_PRIORITY_{name} is no number")
        if not series & set((configuration.getVar(f"LAYERSERIES_COMPAT_{name}") or "").split()):
            found.append(f"{name}: LAYERSERIES_COMPAT_{name} has none of {sorted(series)}")
        needed = (configuration.getVar(f"LAYERDEPENDS_{name}") or "").split()
        if name != "core" and not needed:
            found.append(f"{name}: no LAYERDEPENDS_{name}")
        found += [
            f"{name}: needs {other}, which is no layer" for other in needed if other not in names
        ]
    return found


def owners(configuration: Any, file: Path) -> list[str]:
    """The collections whose BBFILE_PATTERN matches a recipe; it should be one."""
    names = (configuration.getVar("BBFILE_COLLECTIONS") or "").split()
    return [
        name
        for name in names
        if re.match(configuration.getVar(f"BBFILE_PATTERN_{name}") or "$.", os.path.normpath(file))
    ]


def choices(name: str, text: str) -> list[str]:
    """A layer offers machines and distributions, and chooses none."""
    return [
        f"{name}: a layer does not choose the {variable}"
        for variable in ("MACHINE", "DISTRO")
        if re.search(rf"^{variable}\s*[?:]*=", text, re.MULTILINE)
    ]
