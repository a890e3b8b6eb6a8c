#!/bin/sh
# SPDX-License-Identifier: MIT
# Unpack the pinned SOEM sources into app/third_party/soem/ and apply our patches.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)

usage()
{
	cat <<'USAGE'
usage: app/third_party/fetch-soem.sh [--archive FILE] [--force] [--help]

Unpacks what soem.lock pins into app/third_party/soem/ and applies patches/*.patch in order.
A run with nothing to do ends at once; after a change of lock file or patches it unpacks again.

  --archive FILE  take the source distribution from FILE; nothing is downloaded
  --force         unpack even if nothing changed

environment:
  ECDAQ_SOEM_ARCHIVE  as --archive
  ECDAQ_SOEM_TARGET   folder to unpack into (default: soem/ beside this script)
  ECDAQ_SOEM_LOCK     lock file (default: soem.lock beside this script)
  ECDAQ_SOEM_PATCHES  folder of patches (default: patches/ beside this script)
  PYTHON              Python whose pip downloads, under the machine's own pip configuration
                      (default: python3)
  XDG_CACHE_HOME      the archive is kept in ecdaq/ below it (default: ~/.cache)
USAGE
}

die()
{
	printf 'fetch-soem: %s\n' "$*" >&2
	exit 1
}

lock_value()
{
	value=$(sed -n "s/^$1 = //p" "$lock")
	[ -n "$value" ] || die "$lock: no value for '$1'"
	printf '%s\n' "$value"
}

sha256_of()
{
	sha256sum "$1" | cut -d ' ' -f 1
}

# What the unpacked folder is made of: the lock file, the patches and this script.
wanted_stamp()
{
	cat "$lock" "$here/fetch-soem.sh" "$patches"/*.patch 2>/dev/null | sha256sum | cut -d ' ' -f 1
}

download()
{
	if ! "$python" "$here/fetch_archive.py" "$package" "$version" "$file" "$sha256" "$work" \
		> "$work/pip.log" 2>&1; then
		if grep -q 'DO NOT MATCH THE HASHES' "$work/pip.log"; then
			die "$file: the package registry gave an archive with another SHA-256 than soem.lock names"
		fi
		die "cannot download $package $version: $(download_reason)." \
			"Fetch $file elsewhere and give it with --archive FILE."
	fi
	[ -f "$work/$file" ] || die "pip did not leave $file; give it with --archive FILE"
	mkdir -p "$cache"
	mv "$work/$file" "$cache/$file"
}

download_reason()
{
	reason=$(sed -n 's/^ERROR: //p' "$work/pip.log" | tail -n 1)
	[ -n "$reason" ] || reason=$(tail -n 1 "$work/pip.log")
	printf '%s' "${reason:-pip failed without a message}"
}

# Only what is built: SOEM's own C files and its osal interface. Never the WinPcap libraries.
unpack()
{
	top=${file%.tar.gz}
	tar -xzf "$archive" -C "$work" "$top/soem/soem" "$top/soem/osal/osal.h" ||
		die "$archive: cannot unpack"
	mkdir -p "$work/soem/soem" "$work/soem/osal"
	for source in "$work/$top"/soem/soem/*.[ch] "$work/$top/soem/osal/osal.h"; do
		tr -d '\r' < "$source" > "$work/soem/${source#"$work/$top/soem/"}"
	done
}

apply_patches()
{
	for patch_file in "$patches"/*.patch; do
		[ -f "$patch_file" ] || continue
		if ! patch -p1 --batch --forward --fuzz=0 -d "$work/soem" < "$patch_file" \
			> "$work/patch.log" 2>&1; then
			die "${patch_file##*/} does not apply: $(grep -m 1 -E 'FAILED|malformed|find file' \
				"$work/patch.log" || tail -n 1 "$work/patch.log")"
		fi
	done
}

archive=${ECDAQ_SOEM_ARCHIVE:-}
target=${ECDAQ_SOEM_TARGET:-$here/soem}
lock=${ECDAQ_SOEM_LOCK:-$here/soem.lock}
patches=${ECDAQ_SOEM_PATCHES:-$here/patches}
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
for tool in patch tar sha256sum; do
	command -v "$tool" > /dev/null 2>&1 || die "$tool is not installed"
done

stamp=$(wanted_stamp)
if [ "$force" = no ] && [ "$(cat "$target/.stamp" 2>/dev/null)" = "$stamp" ]; then
	exit 0
fi

package=$(lock_value package)
version=$(lock_value version)
file=$(lock_value file)
sha256=$(lock_value sha256)

work=$(mktemp -d "$(dirname -- "$target")/.soem-XXXXXX")
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
found=$(sha256_of "$archive")
[ "$found" = "$sha256" ] ||
	die "$archive: SHA-256 is $found, but soem.lock names $sha256; remove the file or correct the lock file"

unpack
apply_patches
printf '%s\n' "$stamp" > "$work/soem/.stamp"
rm -rf "$target"
mv "$work/soem" "$target"
