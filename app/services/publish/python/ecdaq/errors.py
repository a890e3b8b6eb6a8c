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
