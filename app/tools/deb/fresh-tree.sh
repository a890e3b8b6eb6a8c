#!/bin/sh
# SPDX-License-Identifier: MIT
# A Debian 12 with its packages of priority important, and so without compiler and Python: prints the path of its tree, for
# in-chroot.sh --network. Needs root.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../setup.sh
. "$root/app/tools/setup.sh"
# shellcheck source-path=SCRIPTDIR source=chroot.sh
. "$here/chroot.sh"

[ "$(id -u)" = 0 ] || die "a fresh Debian tree needs root (mmdebstrap and chroot)"
key=$(sha256sum < "$0" | cut -c 1-12)
# Package lists and archives are removed, as by default.
need_chroot fresh "$key" "making a fresh Debian tree" --variant=important
printf '%s\n' "$chroot"
