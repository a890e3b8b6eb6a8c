# SPDX-License-Identifier: MIT
"""The bytes of recordings: files, folders and URLs."""

from __future__ import annotations

import os
import re
import urllib.error
import urllib.request
from collections.abc import Iterable
from http.client import HTTPException
from pathlib import Path
from typing import Protocol

from ecdaq.errors import RecordingError

HTTP_BLOCK = 1 << 16  # smaller reads over HTTP are rounded up to this many bytes, and kept
HTTP_BLOCKS_KEPT = 16
HTTP_TIMEOUT_S = 30
PART = ".part"
# ecdaq-<UTC>-<session>-<sequence>.mcap
NAME = re.compile(r"ecdaq-\w+-([0-9a-f]+)-(\d+)\.mcap(?:\.part)?$")


class Source(Protocol):
    """One recording, read at any offset. All failures are RecordingError."""

    name: str

    def size(self) -> int:
        """Bytes of it now."""
        ...

    def read(self, offset: int, count: int) -> bytes:
        """Exactly @count bytes."""
        ...


class FileSource:
    """A file. It is open only while it is read, so a folder may hold any number."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.name = str(path)

    def _resolve(self) -> Path:
        """The recorder renames NAME.part to NAME when it is finished."""
        if self.path.suffix == PART and not self.path.exists():
            return self.path.with_suffix("")
        return self.path

    def size(self) -> int:
        try:
            return self._resolve().stat().st_size
        except OSError as error:
            raise RecordingError(self.name, error.strerror or str(error)) from error

    def read(self, offset: int, count: int) -> bytes:
        try:
            with self._resolve().open("rb", buffering=0) as file:
                size = os.fstat(file.fileno()).st_size
                if offset + count > size:
                    raise RecordingError(self.name, f"ends at byte {size}: cut off")
                file.seek(offset)
                found = file.read(count)
                while len(found) < count and (more := file.read(count - len(found))):
                    found += more
        except OSError as error:
            raise RecordingError(self.name, error.strerror or str(error)) from error
        if len(found) < count:
            raise RecordingError(self.name, f"ends at byte {offset + len(found)}: cut off")
        return found


class HttpSource:
    """A file on a server that answers Range requests. Only what is needed is transferred."""

    def __init__(self, url: str) -> None:
        self.name = url
        self._size: int | None = None
        self._blocks: dict[int, bytes] = {}

    def size(self) -> int:
        if self._size is None:
            self._fetch(0, 1)
        return self._size or 0

    def _fetch(self, offset: int, count: int) -> bytes:
        headers = {"Range": f"bytes={offset}-{offset + count - 1}", "Accept-Encoding": "identity"}
        try:
            request = urllib.request.Request(self.name, headers=headers)
            with urllib.request.urlopen(request, timeout=HTTP_TIMEOUT_S) as answer:
                if answer.status != 206:
                    raise RecordingError(
                        self.name, "the server ignores Range requests: download the file, read that"
                    )
                found = answer.read(count + 1)
                said = answer.headers.get("Content-Range", "")
        except urllib.error.HTTPError as error:
            if error.code == 416:
                raise RecordingError(self.name, f"ends before byte {offset + 1}") from error
            raise RecordingError(self.name, f"HTTP {error.code} {error.reason}") from error
        except (OSError, HTTPException, ValueError) as error:
            raise RecordingError(self.name, str(getattr(error, "reason", error))) from error
        sizes = re.fullmatch(r"bytes (\d+)-(\d+)/(\d+)", said)
        if not sizes or int(sizes[1]) != offset or len(found) != int(sizes[2]) - offset + 1:
            raise RecordingError(self.name, f"unexpected answer to a Range request: {said!r}")
        if self._size not in (None, int(sizes[3])):
            raise RecordingError(self.name, "changed on the server while it was read")
        self._size = int(sizes[3])
        return found

    def _block(self, number: int) -> bytes:
        blocks = self._blocks
        if (found := blocks.get(number)) is None:
            start = number * HTTP_BLOCK
            found = self._fetch(start, min(HTTP_BLOCK, self.size() - start))
            while len(blocks) >= HTTP_BLOCKS_KEPT:
                blocks.pop(next(iter(blocks)), None)
            blocks[number] = found
        return found

    def read(self, offset: int, count: int) -> bytes:
        if count == 0:
            return b""
        if offset + count > self.size():
            raise RecordingError(self.name, f"ends at byte {self.size()}: cut off")
        if count >= HTTP_BLOCK:
            return self._fetch(offset, count)
        first, last = offset // HTTP_BLOCK, (offset + count - 1) // HTTP_BLOCK
        joined = b"".join(self._block(n) for n in range(first, last + 1))
        start = offset - first * HTTP_BLOCK
        return joined[start : start + count]


def in_order(names: Iterable[str]) -> list[str]:
    """Session by session, by the sequence numbers in the names; other names after those."""
    listed = [(name, NAME.search(name)) for name in names]
    first: dict[str, int] = {}  # of each session
    for _, match in listed:
        if match:
            first[match[1]] = min(first.get(match[1], int(match[2])), int(match[2]))

    def key(entry: tuple[str, re.Match[str] | None]) -> tuple[int, int, str, int]:
        name, match = entry
        return (0, first[match[1]], match[1], int(match[2])) if match else (1, 0, name, 0)

    return [name for name, _ in sorted(listed, key=key)]


def find(where: str | os.PathLike[str]) -> list[Source]:
    """The recordings of a file, a folder or an http(s) URL, in the order they were recorded."""
    text = os.fspath(where)
    if re.match(r"https?://", text):
        return [HttpSource(text)]
    if (scheme := re.match(r"(\w+)://", text)) is not None:
        raise ValueError(f"{text}: {scheme[1]}:// is not supported: use http:// or https://")
    path = Path(text)
    if not path.is_dir():
        if not path.exists():
            raise RecordingError(text, "No such file or directory")
        return [FileSource(path)]
    try:
        names = [entry.name for entry in path.iterdir()]
    except OSError as error:
        raise RecordingError(text, error.strerror or str(error)) from error
    # A file may be renamed from NAME.part to NAME meanwhile: each once.
    finished = {name for name in names if name.endswith(".mcap")}
    unfinished = {n for n in names if n.endswith(".mcap" + PART)} - {n + PART for n in finished}
    if not finished and not unfinished:
        raise RecordingError(text, "no recordings (*.mcap) in this directory")
    return [FileSource(path / name) for name in in_order(finished | unfinished)]
