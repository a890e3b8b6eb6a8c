#!/bin/sh
# SPDX-License-Identifier: MIT
# Debian packages of the programs, for a PC or a board with Debian 12. `./build.sh deb` calls this.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../setup.sh
. "$root/app/tools/setup.sh"
# shellcheck source-path=SCRIPTDIR source=chroot.sh
. "$here/chroot.sh"
# shellcheck source-path=SCRIPTDIR source=../arm64.sh
. "$root/app/tools/arm64.sh"

usage()
{
	cat <<'USAGE'
usage: ./build.sh deb [--suffix SUFFIX] [--to DIR] [--refresh] [amd64 | arm64 | all]

Builds the packages ecdaq, ecdaq-sim, libecdaq1, libecdaq-dev and python3-ecdaq for Debian 12 into
build/deb/ and checks them with lintian: an error or a warning of lintian is a failure. They are built in
a Debian 12 tree of their own, which is kept in ~/.cache/ecdaq/deb/. Needs x86-64 and root.

  amd64            for a PC (default)
  arm64            for a board with Debian 12, cross-compiled; programs that write manual pages run in
                   QEMU's user mode
  all              both

  --suffix SUFFIX  appended to the version, which is that of app/CMakeLists.txt: +git5 makes a version
                   that is newer than the release, ~rc1 one that is older
  --to DIR         put them there
  --refresh        make the tree again first, with the archive's present packages

environment:
  ECDAQ_APT_MIRROR, ECDAQ_APT_SECURITY_MIRROR  Debian mirrors, as for ./build.sh image
  XDG_CACHE_HOME   ecdaq/deb/ below it keeps the trees, 2 GB for each architecture (default: ~/.cache)
USAGE
}

suffix=
to=$root/build/deb
refresh=no
check=no
architectures=
while [ $# -gt 0 ]; do
	case $1 in
	--suffix)
		[ $# -ge 2 ] || usage_error "deb: --suffix needs a value"
		suffix=$2
		printf '%s\n' "$suffix" | grep -qx '[+~][A-Za-z0-9.+~]*' ||
			usage_error "deb: --suffix: '$suffix' is not + or ~ with letters, digits, '.', '+', '~' behind it"
		shift
		;;
	--to)
		[ $# -ge 2 ] || usage_error "deb: --to needs a folder"
		to=$2
		shift
		;;
	--refresh) refresh=yes ;;
	--check) check=yes ;; # build.sh: are the options good?
	--help | -h)
		usage
		exit 0
		;;
	amd64 | arm64) architectures="$architectures $1" ;;
	all) architectures="$architectures amd64 arm64" ;;
	*) usage_error "deb: no architecture or option '$1'; there are: amd64 arm64 all --suffix --to --refresh" ;;
	esac
	shift
done
[ "$check" = no ] || exit 0
architectures=$(printf '%s\n' "${architectures:-amd64}" | tr ' ' '\n' | sort -u)

out=$root/build/deb
packaging=$root/app/packaging
version=$(sed -n 's/^project(ecdaq VERSION \([0-9.]*\) .*/\1/p' "$root/app/CMakeLists.txt")$suffix

# The libraries' headers that app/tools/packages.txt names for the build, as "libyaml-dev, libzstd-dev".
header_packages()
{
	awk '$1 !~ /^#/ && $2 ~ /(^|,)(build|dds|web|stream|uplink)(,|$)/ && $1 ~ /-dev$/ && $1 != "libc6-dev" { print $1 }' \
		"$root/app/tools/packages.txt" | paste -s -d ' ' | sed 's/ /, /g'
}

# What is built: the sources as they are in this tree, in $source.
prepare_source()
{
	rm -rf "$work"
	mkdir -p "$source"
	(cd "$root" && tar -c --exclude=__pycache__ --exclude=app/doc --exclude=app/third_party/soem \
		--exclude=app/third_party/libgpiod app LICENSE LICENSES) |
		tar -x -C "$source"
	mkdir -p "$source/app/doc/reference"
	cp "$root/app/doc/reference/ecdaq.sample.yaml" "$source/app/doc/reference/"
	cp -r "$packaging/debian" "$source/debian"
	cp "$root/CHANGELOG.md" "$source/debian/WHAT-CHANGED.md"
	sed "s/@HEADER_PACKAGES@/$(header_packages)/" "$packaging/debian/control.in" > "$source/debian/control"
	rm "$source/debian/control.in"
	"$packaging/debian-units.sh" "$root/recipes/recipes-core/ecdaq-config/files/root" "$source/debian"
	printf 'ecdaq (%s) %s; urgency=medium\n\n  * What changed is in WHAT-CHANGED.md.\n\n -- %s  %s\n' \
		"$version" "$suite" "$(sed -n 's/^Maintainer: //p' "$source/debian/control")" \
		"$(date -R -u -d "@$SOURCE_DATE_EPOCH")" > "$source/debian/changelog"
	mkdir -p "$source/archives"
	unpack_archive soem "$ECDAQ_SOEM_ARCHIVE"
	unpack_archive libgpiod "$ECDAQ_LIBGPIOD_ARCHIVE"
	cp -r "$wheels" "$source/wheels"
}

# unpack_archive NAME ARCHIVE: foreign sources as the build expects them, and the archive, which is handed on.
unpack_archive()
{
	"$source/app/third_party/fetch-$1.sh" --force --archive "$2"
	cp "$2" "$source/archives/"
}

# The archives of the foreign sources, in the cache or where the environment says.
need_archives()
{
	for name in soem libgpiod; do
		archive=$cache/$(sed -n 's/^file = //p' "$root/app/third_party/$name.lock")
		if [ ! -f "$archive" ]; then
			need_pip
			mkdir -p "$out"
			ECDAQ_SOEM_TARGET=$out/unpacked ECDAQ_LIBGPIOD_TARGET=$out/unpacked \
				"$root/app/third_party/fetch-$name.sh" --force
			rm -rf "$out/unpacked"
		fi
		case $name in
		soem) export ECDAQ_SOEM_ARCHIVE="${ECDAQ_SOEM_ARCHIVE:-$archive}" ;;
		libgpiod) export ECDAQ_LIBGPIOD_ARCHIVE="${ECDAQ_LIBGPIOD_ARCHIVE:-$archive}" ;;
		esac
	done
}

# The Python packages that Debian does not have, pinned with their hashes; kept in the cache. pip asks the sources
# of cyclonedds for their metadata, and these look for the library: an empty one will do.
fetch_wheels()
{
	wheels=$deb_cache/wheels-$(sha256sum < "$packaging/python-private.txt" | cut -c 1-12)
	if [ ! -e "$wheels/.complete" ]; then
		need_pip
		rm -rf "$deb_cache"/wheels-* "$deb_cache/no-cyclonedds"
		mkdir -p "$wheels" "$deb_cache/no-cyclonedds/bin" "$deb_cache/no-cyclonedds/include" \
			"$deb_cache/no-cyclonedds/lib"
		: > "$deb_cache/no-cyclonedds/lib/libddsc.so"
		run_step "fetching Python packages" "$deb_cache/wheels.log" \
			env CYCLONEDDS_HOME="$deb_cache/no-cyclonedds" "$PYTHON" -m pip download --quiet \
			--disable-pip-version-check --no-deps --only-binary mcap --no-binary cyclonedds --require-hashes \
			--dest "$wheels" --requirement "$packaging/python-private.txt" || {
			cat "$deb_cache/wheels.log" >&2
			die "pip cannot fetch app/packaging/python-private.txt (see above)"
		}
		touch "$wheels/.complete"
	fi
	[ "$(find "$wheels" -name '*.whl' -o -name '*.tar.gz' | wc -l)" = 2 ] || die "$wheels is not complete: remove it"
}

# The tree with tools and headers; for arm64 the cross compiler is amd64's.
need_build_tree()
{
	tools="debhelper,dh-python,fakeroot,help2man,lintian,ccache,binutils"
	machines=$arch
	if [ "$arch" != amd64 ]; then
		tools="$tools,crossbuild-essential-$arch"
		machines=amd64,$arch
	fi
	key=$({ echo "$suite $machines $tools" && sed -n '/^Build-Depends:/,/^$/p' "$source/debian/control"; } |
		sha256sum | cut -c 1-12)
	[ "$refresh" = no ] || rm -f "$deb_cache/build-$arch"-*.complete
	# shellcheck disable=SC2016 # expanded by mmdebstrap's shell
	need_chroot "build-$arch" "$key" "making the Debian tree for $arch" --variant=buildd \
		--architectures="$machines" --include="$tools" \
		--customize-hook='mkdir -p "$1/tmp/source/debian"' \
		--customize-hook="copy-in $source/debian/control $source/debian/changelog /tmp/source/debian" \
		--customize-hook='chroot "$1" sh -c "cd /tmp && apt-get -q -y --no-install-recommends \
			--host-architecture '"$arch"' build-dep ./source && rm -rf source"'
}

build()
{
	arch=$1
	work=$out/work/$arch
	source=$work/ecdaq
	[ "$arch" = amd64 ] || need_arm64_programs
	prepare_source
	need_build_tree "$arch"
	# shellcheck disable=SC2016 # expanded by the shell inside
	run_step "building packages for $arch" "$out/build-$arch.log" "$here/in-chroot.sh" --ccache "$deb_cache/ccache" \
		"$chroot" "$work" sh -euc '
		cd /mnt/ecdaq
		export DEB_BUILD_OPTIONS="parallel=$(nproc) nocheck noautodbgsym"
		dpkg-buildpackage --build=binary --unsigned-changes --no-pre-clean --host-arch="$1"
		' build "$arch" || {
		tail -n 40 "$out/build-$arch.log" >&2
		die "cannot build the packages (see above, and build/deb/build-$arch.log)"
	}
	run_step "checking packages for $arch" "$out/lintian-$arch.log" "$here/in-chroot.sh" --ccache "$deb_cache/ccache" \
		"$chroot" "$work" sh -euc '
		cd /mnt
		lintian --fail-on error,warning --tag-display-limit 0 --allow-root ./*.changes
		' lintian || {
		cat "$out/lintian-$arch.log" >&2
		die "lintian found errors or warnings (see above)"
	}
	mkdir -p "$to"
	find "$to" -maxdepth 1 -name "*_$arch.deb" -delete
	mv "$work"/*.deb "$to/"
	rm -rf "$work"
	for package in "$to"/*_"$arch.deb"; do
		note "$package"
	done
}

[ "$(id -u)" = 0 ] || die "deb: needs root (mmdebstrap and chroot); try: sudo ./build.sh deb"
SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct 2> /dev/null || stat -c %Y "$root/app/CMakeLists.txt")
export SOURCE_DATE_EPOCH
mkdir -p "$out"
exec 9> "$out/lock"
flock 9
need_archives
fetch_wheels
for architecture in $architectures; do
	build "$architecture"
done
