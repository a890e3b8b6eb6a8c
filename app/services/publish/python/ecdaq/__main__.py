# SPDX-License-Identifier: MIT
"""python -m ecdaq is ecdaq-remote."""

from ecdaq.remote import main

if __name__ == "__main__":
    raise SystemExit(main())
