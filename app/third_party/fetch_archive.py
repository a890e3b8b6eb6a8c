#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fetch the source archive of a package that a lock file pins, as pip here is configured.

`pip download` asks a source archive for its metadata, for which it first installs what the package
is built with. Only the archive is wanted: it is looked up with pip's own finder and taken with its
session. Those are internal to pip; where they do not work, `pip download` does it, and gives the
reason if it cannot.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import warnings
from pathlib import Path


def fetch_alone(package: str, version: str, file: str, sha256: str, folder: Path) -> bool:
    """Whether the archive, and nothing else, was fetched into @folder."""
    try:
        from pip._internal.commands.download import DownloadCommand

        command = DownloadCommand("download", "")
        words = ["--retries", "0", "--no-binary", package, f"{package}=={version}"]
        options, _ = command.parse_args(words)
        with command.main_context():
            session = command.get_default_session(options)
            finder = command._build_package_finder(options, session)
            links = [c.link for c in finder.find_all_candidates(package) if c.link.filename == file]
            as_it_is = {"Accept-Encoding": "identity"}
            answer = session.get(links[0].url_without_fragment, headers=as_it_is)
        answer.raise_for_status()
    except Exception:  # another pip, no such file, no network: pip download tells
        return False
    if hashlib.sha256(answer.content).hexdigest() != sha256:
        return False
    (folder / file).write_bytes(answer.content)
    return True


def fetch_by_pip(package: str, version: str, sha256: str, folder: Path) -> int:
    """The exit code of `pip download`, which prints what went wrong."""
    required = folder / "requirements.txt"
    required.write_text(f"{package}=={version} --hash=sha256:{sha256}\n")
    words = ["--quiet", "--no-deps", "--no-binary", package, "--require-hashes"]
    words += ["--dest", str(folder), "--requirement", str(required)]
    return subprocess.run([sys.executable, "-m", "pip", "download", *words], check=False).returncode


def main(arguments: list[str]) -> int:
    if len(arguments) != 5:
        print("usage: fetch_archive.py PACKAGE VERSION FILE SHA256 FOLDER", file=sys.stderr)
        return 2
    package, version, file, sha256 = arguments[:4]
    folder = Path(arguments[4])
    warnings.simplefilter("ignore")
    if fetch_alone(package, version, file, sha256, folder):
        return 0
    return fetch_by_pip(package, version, sha256, folder)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
