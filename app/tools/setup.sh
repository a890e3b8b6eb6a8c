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

# usage_error MESSAGE: the command line is wrong.
usage_error()
{
	printf 'build.sh: %s\n' "$*" >&2
	exit 2
}

note()
{
	printf -- '-- %s\n' "$*" >&2
}

# Progress of $text, whose output is in $log: a terminal gets one line that is rewritten, anything
# else a line every 5 s.
report_progress()
{
	half_seconds=0
	while sleep 0.5 > /dev/null 2>&1 && kill -0 "$$" 2> /dev/null; do
		half_seconds=$((half_seconds + 1))
		[ -t 2 ] || [ $((half_seconds % 10)) = 1 ] || continue
		step=$(tail -n 5 "$log" | sed -n 's/^\[\([0-9]*\)\/\([0-9]*\)\].*/ \1 of \2/p' | tail -n 1)
		line="$text$step, $(((half_seconds + 1) / 2)) s"
		if [ -t 2 ]; then
			printf '\r\033[K-- %.72s' "$line" >&2
		else
			note "$line"
		fi
	done
}

# Ends what run_step started, its children included.
interrupt_step()
{
	trap '' INT TERM HUP
	kill "$reporter" 2> /dev/null || true
	kill -TERM "$step_target" 2> /dev/null || true
	wait
	[ ! -t 2 ] || printf '\r\033[K' >&2
	exit "$1"
}

# run_step TEXT LOG COMMAND...: runs a command with its output in LOG and shows progress; returns its
# exit code. The command has a process group of its own (but for sudo, which asks the terminal), so
# that a signal to this shell ends all of it. $ECDAQ_STEP_TIMES, if set, gets a line "MILLISECONDS TEXT".
run_step()
{
	text=$1 log=$2 status=0
	step_start_ms=$(date +%s%3N)
	shift 2
	if [ "$1" = as_root ]; then
		"$@" > "$log" 2>&1 &
		step_target=$!
	else
		setsid "$@" < /dev/null > "$log" 2>&1 &
		step_target=-$!
	fi
	step_pid=$!
	report_progress &
	reporter=$!
	trap 'interrupt_step 130' INT
	trap 'interrupt_step 143' TERM HUP
	wait "$step_pid" || status=$?
	kill "$reporter" 2> /dev/null || true
	wait "$reporter" 2> /dev/null || true
	trap - INT TERM HUP
	[ ! -t 2 ] || printf '\r\033[K' >&2
	[ -z "${ECDAQ_STEP_TIMES:-}" ] ||
		printf '%s\n' "$(($(date +%s%3N) - step_start_ms)) $text" >> "$ECDAQ_STEP_TIMES"
	return "$status"
}

# A Python of 3.11 or newer that can make environments; the machine's own if the first on PATH
# (which may be any) cannot.
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

report_missing()
{
	printf 'build.sh: %s; missing:\n' "$2" >&2
	printf '%s\n' "$1" | while read -r package why; do
		printf '  %-16s %s\n' "$package" "$why" >&2
	done
	exit 1
}

# update_lists: once, the first package that is missing needs it.
update_lists()
{
	[ -z "${lists_are_new:-}" ] || return 0
	run_step "reading Debian's package lists" "$apt_log" as_root apt-get update -q || return 1
	lists_are_new=yes
}

# install_packages NAME...: output in $apt_log. CMake looks again for what it has not found.
install_packages()
{
	update_lists && run_step "installing packages" "$apt_log" as_root env DEBIAN_FRONTEND=noninteractive \
		apt-get install -q -y --no-install-recommends -o DPkg::Lock::Timeout=300 "$@" || return 1
	rm -f "$root"/build/*/configured
}

# prefetch_packages PURPOSE...: what is missing, the optional included, in one go: each start of apt takes seconds.
# Where that fails, need_packages and want_packages find out for which purpose, and say it.
prefetch_packages()
{
	missing=$(missing_packages "$@")
	if [ -z "$missing" ] || ! is_supported_debian; then
		return 0
	fi
	if [ "$(id -u)" != 0 ] && ! command -v sudo > /dev/null 2>&1; then
		return 0
	fi
	names=$(printf '%s\n' "$missing" | cut -f 1 | tr '\n' ' ')
	note "installing $names"
	apt_log=$(mktemp)
	# shellcheck disable=SC2086 # a list of names
	install_packages $names || note "apt-get cannot install all of them at once: one purpose after the other"
	rm -f "$apt_log"
}

# need_packages PURPOSE...: install what is missing, or list it and exit.
need_packages()
{
	missing=$(missing_packages "$@")
	[ -n "$missing" ] || return 0
	is_supported_debian ||
		report_missing "$missing" "this is not Debian 12 or 13: install the equivalents yourself"
	if [ "$(id -u)" != 0 ] && ! command -v sudo > /dev/null 2>&1; then
		report_missing "$missing" "neither root nor sudo: have these Debian packages installed"
	fi
	names=$(printf '%s\n' "$missing" | cut -f 1 | tr '\n' ' ')
	note "installing $names"
	apt_log=$(mktemp)
	# shellcheck disable=SC2086 # a list of names
	if ! install_packages $names; then
		tail -n 5 "$apt_log" >&2
		rm -f "$apt_log"
		report_missing "$missing" "apt-get failed (its last lines are above)"
	fi
	rm -f "$apt_log"
	missing=$(missing_packages "$@")
	[ -z "$missing" ] || report_missing "$missing" "still not found after installing"
}

# want_packages PURPOSE WHAT: the same for what is optional; one line names what is skipped.
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
		exec 9> "$cache/venv.lock"
		flock 9
		[ -f "$venv/.complete" ] || make_venv
		exec 9>&-
	fi
	export PYTHON="$venv/bin/python"
	PATH=$venv/bin:$PATH
}

make_venv()
{
	rm -rf "$venv"
	run_step "making the Python environment" "$cache/venv.log" "$base_python" -m venv "$venv" ||
		die "cannot make $venv (see $cache/venv.log)"
	run_step "installing Python packages" "$cache/venv.log" "$venv/bin/python" -m pip install \
		--quiet --disable-pip-version-check --requirement "$root/tests/requirements.txt" ||
		{
			cat "$cache/venv.log" >&2
			die "pip cannot install tests/requirements.txt (see above)"
		}
	touch "$venv/.complete"
}

# need_pip: sets PYTHON to one with pip, for an archive that is not in the cache. Where the machine has no pip,
# the wheel that ensurepip would install runs as it is, through a script in the cache.
need_pip()
{
	base_python=$(find_python) || die "no Python 3.11 or newer with venv and ensurepip"
	PYTHON=$base_python
	if ! "$PYTHON" -m pip --version > /dev/null 2>&1; then
		wheel=$("$PYTHON" -c 'import ensurepip, glob, os, sysconfig
own = os.path.join(os.path.dirname(ensurepip.__file__), "_bundled")
print(*glob.glob(os.path.join(sysconfig.get_config_var("WHEEL_PKG_DIR") or own, "pip-*.whl"))[:1])')
		mkdir -p "$cache"
		PYTHON=$cache/python-with-pip
		printf '#!/bin/sh\nPYTHONPATH="%s" exec "%s" "$@"\n' "$wheel" "$base_python" > "$PYTHON.$$"
		chmod +x "$PYTHON.$$"
		mv "$PYTHON.$$" "$PYTHON"
		"$PYTHON" -m pip --version > /dev/null 2>&1 || die "$base_python has no pip, and ensurepip none to install"
	fi
	export PYTHON
}

# need_sources: what is compiled and is not in the tree.
need_sources()
{
	mkdir -p "$root/build"
	for name in soem libgpiod; do
		lock=$root/app/third_party/$name.lock
		stamp=$root/app/third_party/$name/.stamp
		if [ -z "${venv:-}" ] && { [ ! -e "$stamp" ] || [ "$lock" -nt "$stamp" ]; } &&
			[ ! -f "$cache/$(sed -n 's/^file = //p' "$lock")" ]; then
			need_pip
		fi
		if ! run_step "fetching $name" "$root/build/fetch-$name.log" \
			"$root/app/third_party/fetch-$name.sh"; then
			cat "$root/build/fetch-$name.log" >&2
			exit 1
		fi
	done
}

# configure_flavour NAME: sets $build_dir and configures it. Ninja itself configures again when a
# CMakeLists.txt has changed, so that is not repeated here unless the options have.
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
	coverage)
		compiler=clang
		set -- "$@" -DECDAQ_FUZZ=ON -DECDAQ_COVERAGE=ON
		;;
	clang) compiler=clang ;;
	*) die "no flavour '$1': release, asan, tsan, fuzz, coverage or clang" ;;
	esac
	shift
	if command -v ccache > /dev/null 2>&1; then
		set -- "$@" -DCMAKE_C_COMPILER_LAUNCHER=ccache
	fi
	mkdir -p "$build_dir"
	set -- cmake -S "$root/app" -B "$build_dir" -G Ninja -DCMAKE_C_COMPILER="$compiler" "$@"
	[ ! -f "$build_dir/build.ninja" ] || [ "$*" != "$(cat "$build_dir/configured" 2> /dev/null)" ] ||
		return 0
	if ! run_step "configuring ${build_dir##*/}" "$build_dir/configure.log" "$@"; then
		cat "$build_dir/configure.log" >&2
		die "cannot configure $build_dir (see above)"
	fi
	printf '%s\n' "$*" > "$build_dir/configured"
}

# build_flavour NAME [TARGET]: configure, build (default: all that the flavour is for), and, except for
# the fuzz targets and TSan's tests, install into $stage.
build_flavour()
{
	configure_flavour "$1"
	stage=$build_dir/stage
	target=${2:-all}
	case $1 in
	fuzz | coverage) target=fuzz_targets ;;
	tsan) target=shared_state ;;
	release) stage=$root/build/stage ;;
	esac
	if ! run_step "compiling $1" "$build_dir/build.log" ninja -C "$build_dir" "$target"; then
		sed -n '/^FAILED:\|^ninja: error/,$p' "$build_dir/build.log" >&2
		die "cannot build $1 (see above, and $build_dir/build.log)"
	fi
	case $1 in fuzz | coverage | tsan) return 0 ;; esac
	cmake --install "$build_dir" --prefix "$stage" > "$build_dir/install.log"
}
