# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Sourced by build-deb.sh and install-tree.sh: Debian trees to build packages in and to install them in. Each is
# made once for its contents and kept in the cache; in-chroot.sh runs a command in one.

suite=bookworm
deb_cache=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq/deb

# Sources of $suite for mmdebstrap: $ECDAQ_APT_MIRROR and $ECDAQ_APT_SECURITY_MIRROR as for the image, else the
# mirrors that apt of this machine uses.
apt_lines()
{
	mirror=${ECDAQ_APT_MIRROR:-}
	security=${ECDAQ_APT_SECURITY_MIRROR:-}
	if [ -z "$mirror" ]; then
		# "'SITE/dists/NAME/InRelease' ..." becomes "NAME SITE".
		sites=$(apt-get update --print-uris 2> /dev/null |
			sed -n "s|^'\([^']*\)/dists/\([^/']*\)/InRelease'.*|\2 \1|p")
		mirror=$(printf '%s\n' "$sites" | awk '$1 ~ /^(bookworm|trixie)$/ { print $2; exit }')
		[ -n "$security" ] ||
			security=$(printf '%s\n' "$sites" | awk '$1 ~ /-security$/ { print $2; exit }')
	fi
	[ -n "$mirror" ] || die "no Debian mirror in this machine's apt sources: give one in ECDAQ_APT_MIRROR"
	printf 'deb %s %s main\n' "$mirror" "$suite" "$mirror" "$suite-updates"
	[ -z "$security" ] || printf 'deb %s %s main\n' "$security" "$suite-security"
}

# need_chroot NAME KEY PROGRESS OPTION...: sets $chroot to the tree NAME for KEY, a hash of all that it is made
# of; OPTIONs are mmdebstrap's. A tree of another key is removed.
need_chroot()
{
	chroot=$deb_cache/$1-$2
	name=$1 progress=$3
	shift 3
	mkdir -p "$deb_cache"
	exec 8> "$deb_cache/lock"
	flock 8
	if [ ! -e "$chroot.complete" ]; then
		for old in "$deb_cache/$name"-*; do
			[ ! -e "$old" ] || rm -rf --one-file-system "$old"
		done
		apt_lines > "$deb_cache/sources.list"
		run_step "$progress" "$deb_cache/$name.log" mmdebstrap --mode=root --format=directory \
			--keyring=/usr/share/keyrings --aptopt='Acquire::Retries "3"' "$@" \
			"$suite" "$chroot" "$deb_cache/sources.list" || {
			grep -v '^I: ' "$deb_cache/$name.log" | tail -n 20 >&2
			rm -rf --one-file-system "$chroot"
			die "cannot make $chroot (see $deb_cache/$name.log)"
		}
		touch "$chroot.complete"
	fi
	exec 8>&-
}
