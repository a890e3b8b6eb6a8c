#!/bin/sh
# SPDX-License-Identifier: MIT
# Build one flavour and install it: build-flavour.sh release|asan|tsan|fuzz|coverage|clang. Expects what
# setup.sh provides to be there; build.sh and run_tests.py call it.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=setup.sh
. "$root/app/tools/setup.sh"

[ $# = 1 ] || die "usage: app/tools/build-flavour.sh release|asan|tsan|fuzz|coverage|clang"
build_flavour "$1"
