#!/bin/sh
# SPDX-License-Identifier: MIT
# The image of a machine, from layers/, recipes/ and kernel-config/. `./build.sh image` calls this.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq/image

usage()
{
	cat <<'USAGE'
usage: ./build.sh image [--machine MACHINE] [--recipe RECIPE] [--jobs N]
                        [--refresh | --plan] [--keyring FILE] [--release]

Builds the disk image of the appliance: a Debian 13 root file system, our PREEMPT_RT kernel and our
programs, from the recipes in recipes/ and layers/. Needs Debian 12 or 13 on x86-64 and root (it makes
chroots, and runs arm64 programs through the kernel's binfmt_misc). Results are cached by the
hash of all inputs: a second run only does what changed. The state of the Debian archive is one of the
inputs: the first run notes it, and packages stay as they are until --refresh.

  --machine MACHINE  ecdaq-qemuarm64 (default): QEMU's virt machine, the segment simulated inside;
                     ecdaq-raspberrypi4-64: Raspberry Pi 4 Model B and Compute Module 4
  --recipe RECIPE    one recipe instead of the whole image: linux-ecdaq, u-boot-ecdaq, soem, ecdaq,
                     ecdaq-config
  --jobs N           tasks at the same time (default: as many as there are cores)
  --refresh          note the archive's present state first: what is made of its packages is made again if
                     it has others now (security updates)
  --plan             print the tasks that would run, with their hashes, and exit
  --keyring FILE     certificates (PEM) of the keys that sign updates of the machine (./build.sh bundle). Default:
                     a development key, made in ~/.cache/ecdaq/update-keys at the first build
  --release          refuse a keyring with a development key, or none

The results are in build/image/MACHINE/: the disk (.img, .img.zst for flashing, .bmap), U-Boot, the
kernel, its command line, the package list (.manifest), the bill of materials (.spdx.json) and .sha256.

environment:
  ECDAQ_APT_MIRROR  Debian mirror to take packages from (default: the one this machine's apt uses)
  ECDAQ_APT_SECURITY_MIRROR
                    mirror of its suite of security updates (default: the one this machine's apt uses;
                    none if ECDAQ_APT_MIRROR is given: there are no security updates then)
  ECDAQ_WIFI        1: with Wi-Fi, for a Raspberry Pi (default: without)
  XDG_CACHE_HOME    ecdaq/image/ below it keeps everything between runs, 11 GB at first, up to 20 GB (default: ~/.cache)
  PYTHON            Python 3.11 or newer with venv (default: python3)
USAGE
}

die()
{
	printf 'build.sh: image: %s\n' "$*" >&2
	exit 1
}

usage_error()
{
	printf 'build.sh: image: %s\n' "$*" >&2
	exit 2
}

machine=ecdaq-qemuarm64
recipe=ecdaq-image
jobs=$(nproc)
plan=
refresh=no
check=no
keyring=
release=no
while [ $# -gt 0 ]; do
	case $1 in
	--machine | --recipe | --jobs | --keyring)
		[ $# -ge 2 ] || usage_error "$1 needs a value"
		case $1 in
		--machine) machine=$2 ;;
		--recipe) recipe=$2 ;;
		--jobs) jobs=$2 ;;
		--keyring) keyring=$2 ;;
		esac
		shift
		;;
	--plan) plan=--dry-run ;;
	--refresh) refresh=yes ;;
	--release) release=yes ;;
	--check) check=yes ;; # build.sh: are the options good?
	--help | -h)
		usage
		exit 0
		;;
	*) usage_error "unknown option '$1' (see --help)" ;;
	esac
	shift
done

[ -f "$root/layers/meta-ecdaq/conf/machine/$machine.conf" ] ||
	usage_error "no machine '$machine'; there are: $(cd "$root/layers/meta-ecdaq/conf/machine" &&
		printf '%s ' *.conf | sed 's/\.conf//g')"
case $jobs in
'' | *[!0-9]* | 0) usage_error "--jobs: '$jobs' is not a number of tasks" ;;
esac
[ -z "$plan" ] || [ "$refresh" = no ] || usage_error "--refresh and --plan exclude each other"
[ -z "$keyring" ] || [ -f "$keyring" ] || usage_error "--keyring: no file '$keyring'"
[ "$release" = no ] || [ -n "$keyring" ] || usage_error "--release needs --keyring: a development key is in no release"

[ "$check" = no ] || exit 0
# shellcheck source-path=SCRIPTDIR source=../arm64.sh
. "$here/../arm64.sh"
# shellcheck source-path=SCRIPTDIR source=update-keys.sh
. "$here/update-keys.sh"
if [ "$release" = yes ] && is_for_development "$keyring"; then
	die "--release: $keyring has a development key"
fi

# pip's own environment for BitBake's library, one for each content of requirements.txt.
need_bitbake()
{
	venv=$cache/venv-$("${PYTHON:-python3}" -c 'import sys; print(sys.version, sys.base_prefix)' |
		cat - "$here/requirements.txt" | sha256sum | cut -c 1-12)
	[ -f "$venv/.complete" ] || {
		rm -rf "$venv"
		"${PYTHON:-python3}" -m venv "$venv" || die "${PYTHON:-python3} cannot make an environment"
		"$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
			--requirement "$here/requirements.txt" ||
			die "pip cannot install app/tools/image/requirements.txt (see above)"
		touch "$venv/.complete"
	}
}

mkdir -p "$cache" "$root/build/image"
exec 9> "$cache/lock"
flock --nonblock 9 || {
	echo '-- another image build is running; waiting for it' >&2
	flock 9
}
need_bitbake
if [ -z "$keyring" ]; then
	make_development_key
	keyring=$development/cert.pem
fi
if [ -z "$plan" ]; then
	[ "$(id -u)" = 0 ] || die "needs root (mmdebstrap and chroot); try: sudo ./build.sh image"
	for tool in mmdebstrap arch-test unshare; do
		command -v "$tool" > /dev/null 2>&1 || die "$tool is not installed"
	done
	need_arm64_programs
fi
PYTHONDONTWRITEBYTECODE=1
export PYTHONDONTWRITEBYTECODE
set -- nice -n 10 "$venv/bin/python" "$here/bake.py" --machine "$machine" --cache "$cache" \
	--build "$root/build/image" --jobs "$jobs" --keyring "$keyring"
# What a build mounts in its chroots goes with its last process, also if that is killed.
[ -n "$plan" ] || set -- unshare --mount --propagation private "$@"
# An empty cache begins with the archive as it is now.
[ -e "$cache/archive.conf" ] || [ -e "$cache/sdk" ] || refresh=yes
if [ "$refresh" = yes ] && [ -z "$plan" ]; then
	"$@" --task do_refresh sdk-chroot
fi
# shellcheck disable=SC2086 # --dry-run or nothing
exec "$@" $plan "$recipe"
