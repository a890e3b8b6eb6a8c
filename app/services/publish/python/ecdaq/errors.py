# SPDX-License-Identifier: MIT
"""What goes wrong."""


class LinkError(Exception):
    """What was asked of the appliance did not come."""


class RefusedError(LinkError):
    """A command was refused; the text says why."""
