# SPDX-License-Identifier: MIT
"""Rules of recipes and layers. Each gives the breaches it finds, one line each."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

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


def layer_conf(name: str, text: str) -> list[str]:
    """A layer names its collection, where its files are, and what it fits to."""
    found = []
    collection = re.search(r'^BBFILE_COLLECTIONS \+= "(\w+)"', text, re.MULTILINE)
    if not collection:
        return [f"{name}: no BBFILE_COLLECTIONS"]
    for field in ("BBFILE_PATTERN", "BBFILE_PRIORITY", "LAYERVERSION", "LAYERSERIES_COMPAT"):
        if f"{field}_{collection[1]} " not in text:
            found.append(f"{name}: no {field}_{collection[1]}")
    for forbidden in ("MACHINE", "DISTRO"):
        if re.search(rf"^{forbidden}\s*[?:]*=", text, re.MULTILINE):
            found.append(f"{name}: a layer does not choose the {forbidden}")
    return found
