#!/bin/sh
# SPDX-License-Identifier: MIT
# A signed bundle of a machine's root file system, for RAUC on the machine. `./build.sh bundle` calls this.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH='' cd -- "$here/../../.." && pwd)

usage()
{
	cat <<'USAGE'
usage: ./build.sh bundle [--machine MACHINE] [--key FILE --cert FILE] [--keyring FILE] [--release]

Builds the image of the machine, and of its root file system a signed bundle that updates machines in
the field: build/image/MACHINE/MACHINE-VERSION.raucb. On the machine: ecdaq-update install FILE.

  --machine MACHINE  as of ./build.sh image (default: ecdaq-qemuarm64)
  --key FILE         private key (PEM) that signs. Default: the development key in
                     ~/.cache/ecdaq/update-keys, made at the first build
  --cert FILE        its certificate (PEM)
  --keyring FILE     certificates that the new image takes updates of (default: that of --cert)
  --release          refuse development keys
USAGE
}

die()
{
	printf 'build.sh: bundle: %s\n' "$*" >&2
	exit 1
}

usage_error()
{
	printf 'build.sh: bundle: %s\n' "$*" >&2
	exit 2
}

machine=ecdaq-qemuarm64
key=
cert=
keyring=
release=no
check=no
while [ $# -gt 0 ]; do
	case $1 in
	--machine | --key | --cert | --keyring)
		[ $# -ge 2 ] || usage_error "$1 needs a value"
		case $1 in
		--machine) machine=$2 ;;
		--key) key=$2 ;;
		--cert) cert=$2 ;;
		--keyring) keyring=$2 ;;
		esac
		shift
		;;
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
for file in "$key" "$cert" "$keyring"; do
	[ -z "$file" ] || [ -f "$file" ] || usage_error "no file '$file'"
done
[ -n "$key" ] || [ -z "$cert" ] || usage_error "--cert needs --key"
[ -n "$cert" ] || [ -z "$key" ] || usage_error "--key needs --cert"
[ "$release" = no ] || [ -n "$key" ] || usage_error "--release needs --key and --cert: a development key is in no release"
# shellcheck source-path=SCRIPTDIR source=update-keys.sh
. "$here/update-keys.sh"
if [ "$release" = yes ] && is_for_development "$cert"; then
	die "--release: $cert is a development key's"
fi
set -- --machine "$machine"
[ -z "$keyring$cert" ] || set -- "$@" --keyring "${keyring:-$cert}"
[ "$release" = no ] || set -- "$@" --release
if [ "$check" = yes ]; then
	exec "$here/build-image.sh" "$@" --check
fi
"$here/build-image.sh" "$@"
if [ -z "$key" ]; then
	make_development_key
	key=$development/key.pem
	cert=$development/cert.pem
fi
folder=$root/build/image/$machine
exec "$here/make-bundle.sh" "$folder/ecdaq-image-ecdaq-$machine.img" "$key" "$cert" "$folder"
