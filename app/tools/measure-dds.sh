#!/bin/sh
# SPDX-License-Identifier: MIT
# Measures what app/doc/reference/dds.md says of DDS, on this machine, and prints it.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=setup.sh
. "$root/app/tools/setup.sh"

usage()
{
	cat <<'USAGE'
usage: app/tools/measure-dds.sh [SECONDS]

Builds, then runs an appliance (simulated segment of two slaves at 1 kHz, ecdaqd, ecdaq-record,
ecdaq-dds) and a PC in two network namespaces with a veth pair between, and measures for SECONDS
(default: 60) each:

  gaps and wrong values of four vendors' subscribers, against the recording
  the cycle with and without eight subscribers, one of them standing still for 4 s
  what 5 % of lost packets cost; a minute of hostile packets
  a command's way to the slave and back; a sample's way from SYNC0 to the subscriber
  ecdaq-dds' share of a core

It needs root, or namespaces of one's own.
USAGE
}

case ${1:-60} in
-h | --help | help)
	usage
	exit 0
	;;
*[!0-9]*) die "measure-dds: '$1' is no number of seconds" ;;
esac
need_packages build test run dds
want_packages foreign "subscribers on Fast DDS and RustDDS"
need_venv
need_soem
need_libgpiod
build_flavour release
log=$(mktemp)
trap 'rm -f "$log"' EXIT
status=0
ECDAQ_DDS_SECONDS=${1:-60} ECDAQ_BUILD=$build_dir ECDAQ_BIN_DIR=$stage/bin "$PYTHON" -m pytest \
	-q -s -p no:cacheprovider "$root/tests/dds/test_foreign.py" \
	"$root/tests/dds/test_figures.py" "$root/tests/dds/test_hostile.py" > "$log" 2>&1 || status=$?
# pytest's dots stand before lines of ours.
sed 's/^[.sF]\{1,\}\([^.]\)/\1/' "$log"
exit "$status"
