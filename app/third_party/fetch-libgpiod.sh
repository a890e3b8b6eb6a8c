#!/bin/sh
# SPDX-License-Identifier: MIT
# Unpack the pinned libgpiod sources into app/third_party/libgpiod/, unless the system has libgpiod 2.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)

usage()
{
	cat <<'USAGE'
usage: app/third_party/fetch-libgpiod.sh [--archive FILE] [--force] [--help]

Unpacks what libgpiod.lock pins into app/third_party/libgpiod/. Nothing is done where pkg-config
finds libgpiod 2 or newer, or where it is unpacked already.

  --archive FILE  take the source distribution from FILE; nothing is downloaded
  --force         unpack even if nothing changed or the system has one

environment:
  ECDAQ_LIBGPIOD_ARCHIVE  as --archive
  ECDAQ_LIBGPIOD_TARGET   folder to unpack into (default: libgpiod/ beside this script)
  ECDAQ_LIBGPIOD_LOCK     lock file (default: libgpiod.lock beside this script)
  PYTHON                  Python whose pip downloads, under the machine's own pip configuration
                          (default: python3)
  XDG_CACHE_HOME          the archive is kept in ecdaq/ below it (default: ~/.cache)
USAGE
}

die()
{
	printf 'fetch-libgpiod: %s\n' "$*" >&2
	exit 1
}

lock_value()
{
	value=$(sed -n "s/^$1 = //p" "$lock")
	[ -n "$value" ] || die "$lock: no value for '$1'"
	printf '%s\n' "$value"
}

download()
{
	if ! "$python" "$here/fetch_archive.py" "$package" "$version" "$file" "$sha256" "$work" \
		> "$work/pip.log" 2>&1; then
		if grep -q 'DO NOT MATCH THE HASHES' "$work/pip.log"; then
			die "$file: the package registry gave an archive with another SHA-256 than libgpiod.lock names"
		fi
		reason=$(sed -n 's/^ERROR: //p' "$work/pip.log" | tail -n 1)
		die "cannot download $package $version: ${reason:-pip failed}." \
			"Fetch $file elsewhere and give it with --archive FILE."
	fi
	[ -f "$work/$file" ] || die "pip did not leave $file; give it with --archive FILE"
	mkdir -p "$cache"
	mv "$work/$file" "$cache/$file"
}

archive=${ECDAQ_LIBGPIOD_ARCHIVE:-}
target=${ECDAQ_LIBGPIOD_TARGET:-$here/libgpiod}
lock=${ECDAQ_LIBGPIOD_LOCK:-$here/libgpiod.lock}
python=${PYTHON:-python3}
cache=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq
force=no

while [ $# -gt 0 ]; do
	case $1 in
	--archive)
		[ $# -ge 2 ] || die "--archive needs a file"
		archive=$2
		shift
		;;
	--force) force=yes ;;
	--help)
		usage
		exit 0
		;;
	*) die "unknown argument '$1' (see --help)" ;;
	esac
	shift
done

[ -f "$lock" ] || die "$lock: no such file"
if [ "$force" = no ]; then
	if pkg-config --atleast-version=2.0 libgpiod 2> /dev/null; then
		exit 0
	fi
	if [ "$(cat "$target/.stamp" 2> /dev/null)" = "$(cat "$lock" "$here/fetch-libgpiod.sh" |
		sha256sum | cut -d ' ' -f 1)" ]; then
		exit 0
	fi
fi

package=$(lock_value package)
version=$(lock_value version)
file=$(lock_value file)
sha256=$(lock_value sha256)

work=$(mktemp -d "$(dirname -- "$target")/.libgpiod-XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

if [ -z "$archive" ]; then
	archive=$cache/$file
	if [ ! -f "$archive" ]; then
		"$python" -m pip --version > /dev/null 2>&1 ||
			die "$python has no pip to download $file with; install it or give --archive FILE"
		download
	fi
fi
[ -f "$archive" ] || die "$archive: no such file"
found=$(sha256sum "$archive" | cut -d ' ' -f 1)
[ "$found" = "$sha256" ] ||
	die "$archive: SHA-256 is $found, but libgpiod.lock names $sha256; remove the file or correct the lock file"

top=${file%.tar.gz}
tar -xzf "$archive" -C "$work" "$top/lib" "$top/include" "$top/LICENSE" ||
	die "$archive: cannot unpack"
cat "$lock" "$here/fetch-libgpiod.sh" | sha256sum | cut -d ' ' -f 1 > "$work/$top/.stamp"
rm -rf "$target"
mv "$work/$top" "$target"
