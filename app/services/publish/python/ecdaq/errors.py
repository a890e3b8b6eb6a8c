# SPDX-License-Identifier: MIT
"""Errors of the kit; exit_code is that of ecdaq-remote (app/doc/reference/exit-codes.md)."""


class LinkError(Exception):
    """The connection to the appliance failed."""

    exit_code = 1


class InterfaceError(LinkError):
    """The network interface does not exist or cannot be used."""

    exit_code = 5


class NoAnswerError(LinkError):
    """The appliance did not answer in time."""

    exit_code = 16


class RefusedError(LinkError):
    """The appliance rejected a command; the text is its reason."""

    exit_code = 17


class RecordingError(Exception):
    """A recording cannot be read: damaged, cut off, not of ecdaq, or not reachable."""

    exit_code = 1

    def __init__(self, file: str, reason: str) -> None:
        super().__init__(f"{file}: {reason}")
        self.file = file
        self.reason = reason


class MissingExtraError(ImportError):
    """A package is needed that is installed only on request."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(f"{package} is not installed: pip install 'ecdaq[{extra}]'")
