#!/bin/sh
# SPDX-License-Identifier: MIT
# The only entry point of ecdaq's source tree: ./build.sh help
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
# shellcheck source-path=SCRIPTDIR source=app/tools/setup.sh
. "$root/app/tools/setup.sh"

usage()
{
	cat <<'USAGE'
usage: ./build.sh VERB [OPTION...]

  run      a simulated segment, the master, the recorder, DDS and the live view, on this machine
  test     the tests, all groups or some
  build    compile, and lay what others use into build/stage/
  sim      the simulated segment alone, on a network interface
  fuzz     search for inputs that break a parser
  lint     formatting, static analysis, shell and Python checks
  clean    remove what was built
  image    the disk image of the SBC, or of the machine that QEMU plays
  boot     that image in QEMU
  help     this, or ./build.sh help VERB for its options

What is missing on Debian 12 or 13 is installed (as root or with sudo); elsewhere it is named.
The list with reasons: app/tools/packages.txt. Downloads are kept in ~/.cache/ecdaq/.

environment of every verb:
  PYTHON              Python 3.11 or newer to start from (default: python3 on PATH, else the machine's)
  XDG_CACHE_HOME      where ecdaq/ keeps its downloads and Python environment (default: ~/.cache)
  ECDAQ_SOEM_ARCHIVE  the archive that app/third_party/soem.lock names, where no registry is reached
  ECDAQ_LIBGPIOD_ARCHIVE  the same of app/third_party/libgpiod.lock
  PIP_*, pip.conf     the machine's own pip configuration holds
  ECDAQ_OS_RELEASE    what says which system this is (default: /etc/os-release)
USAGE
}

help_build()
{
	cat <<'USAGE'
usage: ./build.sh build [FLAVOUR...]

  release   -O2, gcc; into build/release/, installed into build/stage/{bin,lib,include,share} (default)
  asan      AddressSanitizer and UndefinedBehaviorSanitizer; build/asan/, build/asan/stage/
  tsan      ThreadSanitizer; build/tsan/
  fuzz      the fuzz targets: clang, libFuzzer, both sanitizers; build/fuzz/
  clang     -O2 with the second compiler; build/clang/

ccache is used where it is installed. Assertions stay on in every flavour.
USAGE
}

help_test()
{
	cat <<'USAGE'
usage: ./build.sh test [--fail-fast | --keep-going] [--only PATTERN] [--fuzz-seconds N] [GROUP...]

Without GROUP all groups run, the fast ones first:
  unit     app/, module by module; also under ASan+UBSan, and what threads share under TSan
  tidy     the rules of the source tree: include table, banned calls, sizes, formatting, lint
  cli      the operator's tool and the programs' command lines; also under ASan+UBSan
  replay   captures of real buses against the simulated segment
  sim      the whole master on virtual time; also under ASan+UBSan
  fuzz     every fuzz target: its corpus, then some seconds of search
  recipes  the image's recipes and layers, parsed by BitBake, held against their rules
  live     everything over a veth pair, in real time
  dds      samples and commands over DDS between two namespaces
  boot     the images, built and looked at, and in QEMU; skipped, and said so, where one is not root
Only when named:
  control  of unit, sim, cli and live what is about control programs
  sync0    of unit, cli and live what is about the SYNC0 check
  wire     SYNC0 on GPIO lines of the image in QEMU; as root, on a machine that does nothing else

  --keep-going      run all groups even if one fails (default)
  --fail-fast       stop behind the first suite with a failure
  --only PATTERN    only tests whose name matches (ctest -R, pytest -k)
  --fuzz-seconds N  of search for each fuzz target (default: 5)

Skipped tests are listed with their reasons. The last line is "N passed, N failed, N skipped"; the
exit code is 0 only if nothing failed and no group that was to run was empty. Logs: build/test-logs/.

environment:
  ECDAQ_FUZZ_SECONDS  as --fuzz-seconds
  ECDAQ_DATA          folder with captures/ and sii/ of real slaves (default: ../shared/data)
USAGE
}

help_run()
{
	"$root/app/tools/run-segment.sh" --help
}

help_sim()
{
	cat <<'USAGE'
usage: ./build.sh sim OPTION...

Builds, then starts the simulated segment (build/stage/bin/ecdaq-sim) with the options given, for a
master of your own on the other end of a cable or veth pair. It needs CAP_NET_RAW. Its options:
  build/stage/bin/ecdaq-sim --help
USAGE
}

help_fuzz()
{
	cat <<'USAGE'
usage: ./build.sh fuzz [TARGET] [SECONDS]

Searches for inputs that break TARGET, a folder of tests/fuzz/ (default: each in turn), for SECONDS
(default: 60). New inputs are kept in build/fuzz/corpus/TARGET, breaking ones in
build/fuzz/artifacts/TARGET.
USAGE
}

help_lint()
{
	cat <<'USAGE'
usage: ./build.sh lint [--fix]

Runs tests/tidy: clang-format, clang-tidy, ruff, shellcheck and the rules of the source tree.

  --fix   first let clang-format and ruff mend what they can
USAGE
}

help_clean()
{
	cat <<'USAGE'
usage: ./build.sh clean [--all]

Removes build/. With --all also the unpacked SOEM sources and ~/.cache/ecdaq/.
USAGE
}

help_image()
{
	"$root/app/tools/image/build-image.sh" --help
}

help_boot()
{
	"$root/app/tools/image/boot.sh" --help
}

help_help()
{
	usage
}

prepare_build()
{
	need_packages build "$@"
	want_packages dds ecdaq-dds
	need_venv
	need_soem
	need_libgpiod
}

do_build()
{
	[ $# -gt 0 ] || set -- release
	prepare_build
	for flavour in "$@"; do
		case $flavour in
		fuzz | clang) need_packages build test ;;
		esac
		build_flavour "$flavour"
		note "built $flavour in build/$flavour/"
	done
}

do_test()
{
	prepare_build test run dds
	case " ${1:--} $* " in
	" -"* | *" dds "*) want_packages foreign "subscribers on Fast DDS and RustDDS" ;;
	esac
	exec "$PYTHON" "$root/app/tools/run_tests.py" "$@"
}

do_run()
{
	"$root/app/tools/run-segment.sh" --check "$@"
	prepare_build run
	build_flavour release
	exec "$root/app/tools/run-segment.sh" "$@"
}

do_sim()
{
	prepare_build
	build_flavour release
	exec "$stage/bin/ecdaq-sim" "$@"
}

do_fuzz()
{
	target=${1:-}
	seconds=${2:-60}
	case $seconds in
	'' | *[!0-9]*) die "fuzz: '$seconds' is no number of seconds" ;;
	esac
	[ -z "$target" ] || [ -d "$root/tests/fuzz/$target" ] || die "fuzz: no target '$target' in tests/fuzz/"
	do_test --fuzz-seconds "$seconds" --only "${target:+^fuzz_$target\$}" fuzz
}

do_lint()
{
	prepare_build test
	case ${1:-} in
	'') ;;
	--fix) "$PYTHON" "$root/tests/tidy/fix.py" ;;
	*) die "lint: unknown option '$1' (see ./build.sh help lint)" ;;
	esac
	exec "$PYTHON" "$root/app/tools/run_tests.py" tidy
}

do_clean()
{
	case ${1:-} in
	'') rm -rf "$root/build" ;;
	--all) rm -rf "$root/build" "$root/app/third_party/soem" "$root/app/third_party/libgpiod" "$cache" ;;
	*) die "clean: unknown option '$1' (see ./build.sh help clean)" ;;
	esac
}

# BitBake's library has an environment of its own: it needs Python, but none of the tests' packages.
do_image()
{
	"$root/app/tools/image/build-image.sh" --check "$@"
	need_packages image
	PYTHON=$(find_python) || die "no Python 3.11 or newer with venv and ensurepip"
	export PYTHON
	exec "$root/app/tools/image/build-image.sh" "$@"
}

do_boot()
{
	"$root/app/tools/image/boot.sh" --check "$@"
	need_packages image
	exec "$root/app/tools/image/boot.sh" "$@"
}

verb=${1:-help}
[ $# -eq 0 ] || shift
case $verb in
build | test | run | sim | fuzz | lint | clean | image | boot)
	for argument in "$@"; do
		if [ "$argument" = --help ] && [ "$verb" != sim ]; then
			"help_$verb"
			exit 0
		fi
	done
	"do_$verb" "$@"
	;;
help | --help | -h)
	case ${1:-help} in
	build | test | run | sim | fuzz | lint | clean | image | boot | help) "help_${1:-help}" ;;
	*) die "no verb '$1'; there are: run test build sim fuzz lint clean image boot help" ;;
	esac
	;;
*) die "no verb '$verb'; there are: run test build sim fuzz lint clean image boot help" ;;
esac
