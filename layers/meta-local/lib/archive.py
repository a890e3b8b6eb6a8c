# SPDX-License-Identifier: MIT
"""The state of a Debian archive: what its Release files list, and the day of the newest of them."""

from __future__ import annotations

import hashlib
import re
from datetime import date
from email.utils import parsedate_to_datetime

DATE = re.compile(r"^Date: (.+)$", re.MULTILINE)
# Other fields, and the signature, change each time that a suite is signed again.
INDEXES = re.compile(r"^SHA256:[ \t]*\n((?:[ \t]+\S.*\n)+)", re.MULTILINE)


class ArchiveError(Exception):
    """A file that is no Release file."""


def _one(release: str) -> tuple[str, date]:
    written, indexes = DATE.search(release), INDEXES.search(release)
    if written is None or indexes is None:
        raise ArchiveError("a Release file without Date or SHA256")
    return indexes[1], parsedate_to_datetime(written[1]).date()


def state(releases: list[str]) -> tuple[str, date]:
    """Digest of all package lists of these suites, whatever their order, and the newest date."""
    if not releases:
        raise ArchiveError("no Release file")
    parts = [_one(release) for release in releases]
    digest = hashlib.sha256("\0".join(sorted(indexes for indexes, _ in parts)).encode())
    return digest.hexdigest(), max(written for _, written in parts)


def configuration(releases: list[str]) -> str:
    """The state as a BitBake configuration file."""
    digest, written = state(releases)
    return f'ECDAQ_ARCHIVE = "{digest}"\nECDAQ_ARCHIVE_DATE = "{written.isoformat()}"\n'
