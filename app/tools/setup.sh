# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Sourced by build.sh and the scripts beside this file: what has to be on the machine, the Python
# environment, the SOEM sources, and the flavours of the build. Expects $root, the top of the tree.

: "${root:?set it to the top of the tree}"
cache=${XDG_CACHE_HOME:-$HOME/.cache}/ecdaq

die()
{
	printf 'build.sh: %s\n' "$*" >&2
	exit 1
}

note()
{
	printf -- '-- %s\n' "$*" >&2
}

# A Python of 3.11 or newer that can make environments; the machine's own if the first on PATH
# (which may be anybody's) cannot.
find_python()
{
	for candidate in ${PYTHON:-} python3 /usr/bin/python3; do
		if "$candidate" -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' \
			> /dev/null 2>&1; then
			printf '%s\n' "$candidate"
			return 0
		fi
	done
	return 1
}

is_present()
{
	case $1 in
	cmd:*) command -v "${1#cmd:}" > /dev/null 2>&1 ;;
	hdr:*) printf '#include <%s>\n' "${1#hdr:}" | gcc -E - > /dev/null 2>&1 ;;
	pymod:*) find_python > /dev/null ;;
	file:*) [ -e "${1#file:}" ] ;;
	hdr++:*) printf '#include <%s>\n' "${1#hdr++:}" | c++ -x c++ -E - > /dev/null 2>&1 ;;
	fuzzer)
		printf 'int LLVMFuzzerTestOneInput(const char *d, unsigned long n) { return !d || !n; }\n' |
			clang -x c -fsanitize=fuzzer -o /dev/null - > /dev/null 2>&1
		;;
	*) die "app/tools/packages.txt: unknown check '$1'" ;;
	esac
}

# "A@12|B@13" is A in Debian 12 and B in Debian 13.
package_here()
{
	case $1 in *@*) ;; *)
		printf '%s\n' "$1"
		return
		;;
	esac
	# shellcheck disable=SC1090 # a file of the machine
	version=$(. "${ECDAQ_OS_RELEASE:-/etc/os-release}" && printf '%s\n' "${VERSION_ID:-}")
	for name in $(printf '%s\n' "$1" | tr '|' ' '); do
		if [ "${name#*@}" = "$version" ]; then
			printf '%s\n' "${name%@*}"
			return
		fi
	done
	printf '%s\n' "${1%%@*}"
}

# Lines "PACKAGE WHY" of what is missing for the purposes given.
missing_packages()
{
	grep -v '^#' "$root/app/tools/packages.txt" | while read -r package purposes check why; do
		for purpose in "$@"; do
			case ,$purposes, in
			*,"$purpose",*)
				is_present "$check" ||
					printf '%s\t%s\n' "$(package_here "$package")" "$why"
				break
				;;
			esac
		done
	done
}

is_supported_debian()
{
	release=${ECDAQ_OS_RELEASE:-/etc/os-release}
	[ -r "$release" ] || return 1
	# shellcheck disable=SC1090 # a file of the machine
	( . "$release" && [ "${ID:-}" = debian ] &&
		{ [ "${VERSION_ID:-}" = 12 ] || [ "${VERSION_ID:-}" = 13 ]; } )
}

as_root()
{
	if [ "$(id -u)" = 0 ]; then
		"$@"
	elif [ -t 0 ]; then
		sudo "$@"
	else
		sudo -n "$@"
	fi
}

say_missing()
{
	printf 'build.sh: %s; missing:\n' "$2" >&2
	printf '%s\n' "$1" | while read -r package why; do
		printf '  %-16s %s\n' "$package" "$why" >&2
	done
	exit 1
}

# need_packages PURPOSE...: install what is missing, or say plainly what it is.
need_packages()
{
	missing=$(missing_packages "$@")
	[ -n "$missing" ] || return 0
	is_supported_debian ||
		say_missing "$missing" "this is not Debian 12 or 13, install the like of these yourself"
	if [ "$(id -u)" != 0 ] && ! command -v sudo > /dev/null 2>&1; then
		say_missing "$missing" "neither root nor sudo, have these Debian packages installed"
	fi
	names=$(printf '%s\n' "$missing" | cut -f 1 | tr '\n' ' ')
	note "installing $names"
	log=$(mktemp)
	# shellcheck disable=SC2086 # a list of names
	if ! { as_root apt-get update -q && as_root env DEBIAN_FRONTEND=noninteractive apt-get install \
		-q -y --no-install-recommends -o DPkg::Lock::Timeout=300 $names; } > "$log" 2>&1; then
		tail -n 5 "$log" >&2
		rm -f "$log"
		say_missing "$missing" "apt-get failed (its last lines stand above)"
	fi
	rm -f "$log"
	missing=$(missing_packages "$@")
	[ -z "$missing" ] || say_missing "$missing" "installed, and still not found"
}

# want_packages PURPOSE WHAT: the same where it can do without; one line says what is left out.
want_packages()
{
	[ -n "$(missing_packages "$1")" ] || return 0
	if ! why=$( (need_packages "$1") 2>&1); then
		names=$(missing_packages "$1" | cut -f 1 | tr '\n' ' ')
		reason=$(printf '%s\n' "$why" | sed -n 's/^build.sh: \(.*\); missing:$/\1/p')
		note "without $2, which needs ${names% }: $reason"
	fi
}

# need_venv: sets $venv to an environment with tests/requirements.txt, made once for its contents.
need_venv()
{
	base_python=$(find_python) || die "no Python 3.11 or newer with venv and ensurepip"
	key=$( { "$base_python" -c 'import sys; print(sys.version, sys.base_prefix)'
		cat "$root/tests/requirements.txt"; } | sha256sum | cut -c 1-12)
	venv=$cache/venv-$key
	if [ ! -f "$venv/.complete" ]; then
		mkdir -p "$cache"
		(
			flock 9
			[ -f "$venv/.complete" ] || make_venv
		) 9> "$cache/venv.lock" || exit 1
	fi
	export PYTHON="$venv/bin/python"
	PATH=$venv/bin:$PATH
}

make_venv()
{
	note "making the Python environment $venv"
	rm -rf "$venv"
	"$base_python" -m venv "$venv" || die "cannot make $venv"
	"$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
		--requirement "$root/tests/requirements.txt" ||
		die "pip cannot install tests/requirements.txt (its reason stands above)"
	touch "$venv/.complete"
}

need_soem()
{
	"$root/app/third_party/fetch-soem.sh" || exit 1
}

need_libgpiod()
{
	"$root/app/third_party/fetch-libgpiod.sh" || exit 1
}

# configure_flavour NAME: sets $build_dir and configures it.
configure_flavour()
{
	build_dir=$root/build/$1
	compiler=gcc
	case $1 in
	release) ;;
	asan) set -- "$@" -DECDAQ_SANITIZE=address,undefined ;;
	tsan) set -- "$@" -DECDAQ_SANITIZE=thread ;;
	fuzz)
		compiler=clang
		set -- "$@" -DECDAQ_FUZZ=ON -DECDAQ_SANITIZE=address,undefined
		;;
	clang) compiler=clang ;;
	*) die "no flavour '$1': release, asan, tsan, fuzz or clang" ;;
	esac
	shift
	if command -v ccache > /dev/null 2>&1; then
		set -- "$@" -DCMAKE_C_COMPILER_LAUNCHER=ccache
	fi
	mkdir -p "$build_dir"
	if ! cmake -S "$root/app" -B "$build_dir" -G Ninja -DCMAKE_C_COMPILER="$compiler" "$@" \
		> "$build_dir/configure.log" 2>&1; then
		cat "$build_dir/configure.log" >&2
		die "cannot configure $build_dir (cmake's reason stands above)"
	fi
}

# build_flavour NAME: configure, build, and, but for the fuzz targets, install into $stage.
build_flavour()
{
	configure_flavour "$1"
	stage=$build_dir/stage
	case $1 in
	fuzz)
		cmake --build "$build_dir" --target fuzz_targets -- --quiet >&2
		return
		;;
	release) stage=$root/build/stage ;;
	esac
	cmake --build "$build_dir" -- --quiet >&2
	cmake --install "$build_dir" --prefix "$stage" > "$build_dir/install.log"
}
