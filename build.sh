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
  test     run the tests, all groups or some
  build    compile and install into build/stage/
  sim      run the simulated segment alone, on a network interface
  fuzz     search for inputs that break a parser
  lint     formatting, static analysis, shell and Python checks
  measure  measure on this machine and write the pages of app/doc/results/
  bench    measure ecdaq beside other EtherCAT masters, how fast virtual time is, and the set-up
  clean    remove what was built
  deb      build Debian packages of the programs, for a PC or a board with Debian 12
  image    build the disk image of the SBC, or of the QEMU machine
  bundle   build a signed bundle that updates such a machine in the field
  boot     boot that image in QEMU
  help     print this, or the options of a verb: ./build.sh help VERB

Missing packages are installed on Debian 12 or 13 (as root or with sudo) and listed on other systems;
app/tools/packages.txt has the purpose of each. Downloads are kept in ~/.cache/ecdaq/.

exit codes: 0 done, 1 failed, 2 wrong command line, 130 and 143 ended by SIGINT and SIGTERM.

environment of every verb:
  PYTHON              Python 3.11 or newer to start from (default: python3 on PATH, else the machine's)
  XDG_CACHE_HOME      where ecdaq/ keeps its downloads and Python environment (default: ~/.cache)
  ECDAQ_SOEM_ARCHIVE  local copy of the archive in app/third_party/soem.lock (default: downloaded)
  ECDAQ_LIBGPIOD_ARCHIVE  local copy of the archive in app/third_party/libgpiod.lock
  PIP_*, pip.conf     pip's own configuration applies
  ECDAQ_STEP_TIMES    file that gets a line "MILLISECONDS STEP" for each step of the set-up and the build
  ECDAQ_OS_RELEASE    file that identifies the system (default: /etc/os-release)
USAGE
}

help_build()
{
	cat <<'USAGE'
usage: ./build.sh build [FLAVOUR...]

  release   -O2, gcc; into build/release/, installed into build/stage/{bin,lib,include,share} (default)
  asan      AddressSanitizer and UndefinedBehaviorSanitizer; build/asan/, build/asan/stage/
  tsan      ThreadSanitizer, the tests of what threads share; build/tsan/
  fuzz      the fuzz targets: clang, libFuzzer, both sanitizers; build/fuzz/
  coverage  the fuzz targets, counting the lines they reach; build/coverage/
  clang     -O2 with the second compiler; build/clang/

ccache is used where it is installed. Assertions stay on in every flavour.
USAGE
}

help_test()
{
	cat <<'USAGE'
usage: ./build.sh test [--fail-fast | --keep-going] [--only PATTERN] [--fuzz-seconds N] [GROUP...]

Without GROUP all groups run, the fast ones first, cli and docs beside the computing ones; meanwhile
the images are built with what time the processors have left. What measures time is last, and alone:
  unit     app/, module by module; also under ASan+UBSan, and what threads share under TSan
  tidy     the rules of the source tree: include table, banned calls, sizes, formatting, links, lint
  cli      the operator's tool and the programs' command lines; also under ASan+UBSan
  kit      the Python kit: recordings read and converted, without a bus
  replay   captures of real buses against the simulated segment
  sim      the whole master on virtual time; also under ASan+UBSan
  cost     instructions of a cycle, a recorded and a published sample and a cycle on virtual time,
           counted by callgrind
  fuzz     every fuzz target: its corpus, then some seconds of search
  recipes  the image's recipes and layers, parsed by BitBake, and their rules
  deb      the Debian packages: built, and installed, upgraded and removed in a chroot; needs root
  live     everything over a veth pair, in real time
  dds      samples and commands over DDS between two namespaces
  docs     the commands of README and of the tutorials, in a fresh clone
  boot     the images, built, inspected and booted in QEMU; skipped, with a message, without root
Only when named:
  control  the tests of control programs in unit, sim, cli and live
  sync0    the tests of the SYNC0 check in unit, cli and live
  deb-arm64  the Debian packages for arm64: compared with those for amd64, installed, started
  coverage the lines of each parser that its fuzz target reaches; fails below 80 %
  long     hours of bus time and of SYNC0 edges on virtual time
  boot-long  the image in QEMU: first start of large disks, DHCP, clock after power-off, watchdog of a hung manager
  wire     SYNC0 on GPIO lines of the image in QEMU; as root, on an idle machine
  update   updates of the image in QEMU, from slot to slot

  --keep-going      run all groups even if one fails (default)
  --fail-fast       stop after the first suite with a failure
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

  --fix   first let clang-format and ruff fix what they can
USAGE
}

help_measure()
{
	"$root/app/tools/measure.py" --help
}

help_bench()
{
	"$root/app/tools/bench.py" --help
}

help_clean()
{
	cat <<'USAGE'
usage: ./build.sh clean [--all]

Removes build/. With --all also the unpacked SOEM sources and ~/.cache/ecdaq/.
USAGE
}

help_deb()
{
	"$root/app/tools/deb/build-deb.sh" --help
}

help_image()
{
	"$root/app/tools/image/build-image.sh" --help
}

help_bundle()
{
	"$root/app/tools/image/build-bundle.sh" --help
}

help_boot()
{
	"$root/app/tools/image/boot.sh" --help
}

help_help()
{
	usage
}

# prepare_programs PURPOSE...: what `run` starts, and not the programs that hand data to servers.
prepare_programs()
{
	need_packages build "$@"
	want_packages dds ecdaq-dds
	want_packages web ecdaq-web
	need_sources
}

prepare_build()
{
	prefetch_packages build dds web stream uplink "$@"
	prepare_programs "$@"
	want_packages stream ecdaq-stream
	want_packages uplink ecdaq-uplink
}

# What the tests need on top of that.
prepare_tests()
{
	need_venv
	prepare_build test "$@"
}

do_build()
{
	[ $# -gt 0 ] || set -- release
	for flavour in "$@"; do
		case $flavour in
		release | asan | tsan | fuzz | coverage | clang) ;;
		*) usage_error "build: no flavour '$flavour'; there are: release asan tsan fuzz coverage clang" ;;
		esac
	done
	prepare_build
	for flavour in "$@"; do
		case $flavour in
		fuzz | coverage | clang) need_packages build test ;;
		esac
		build_flavour "$flavour"
		note "built $flavour in build/$flavour/"
		[ "$flavour" != release ] ||
			note "to have the programs on PATH: export PATH=\"$stage/bin:\$PATH\""
	done
}

do_test()
{
	# A wrong word is reported before anything is installed or built.
	if python=$(find_python); then
		"$python" "$root/app/tools/run_tests.py" --check "$@"
	fi
	prepare_tests run dds
	case " ${1:--} $* " in
	" -"* | *" dds "*) want_packages foreign "subscribers on Fast DDS and RustDDS" ;;
	esac
	[ -z "${CI:-}" ] || want_packages ci "a cache of compilations and a browser"
	exec "$PYTHON" "$root/app/tools/run_tests.py" "$@"
}

do_run()
{
	"$root/app/tools/run-segment.sh" --check "$@"
	prefetch_packages build dds web run
	prepare_programs run
	build_flavour release programs
	exec "$root/app/tools/run-segment.sh" "$@"
}

do_sim()
{
	prefetch_packages build
	need_packages build
	need_sources
	build_flavour release programs
	exec "$stage/bin/ecdaq-sim" "$@"
}

do_fuzz()
{
	target=${1:-}
	seconds=${2:-60}
	case $seconds in
	'' | *[!0-9]*) usage_error "fuzz: '$seconds' is not a number of seconds" ;;
	esac
	[ -z "$target" ] || [ -d "$root/tests/fuzz/$target" ] ||
		usage_error "fuzz: no target '$target' in tests/fuzz/"
	do_test --fuzz-seconds "$seconds" --only "${target:+^fuzz_$target\$}" fuzz
}

do_lint()
{
	case ${1:-} in
	'' | --fix) ;;
	*) usage_error "lint: unknown option '$1' (see ./build.sh help lint)" ;;
	esac
	prepare_tests
	[ -z "${1:-}" ] || "$PYTHON" "$root/tests/tidy/fix.py"
	exec "$PYTHON" "$root/app/tools/run_tests.py" tidy
}

do_clean()
{
	case ${1:-} in
	'') rm -rf "$root/build" ;;
	--all) rm -rf "$root/build" "$root/app/third_party/soem" "$root/app/third_party/libgpiod" "$cache" ;;
	*) usage_error "clean: unknown option '$1' (see ./build.sh help clean)" ;;
	esac
}

do_measure()
{
	if python=$(find_python); then
		"$python" "$root/app/tools/measure.py" --check "$@"
	fi
	prepare_tests run dds
	build_flavour release
	exec "$PYTHON" "$root/app/tools/measure.py" "$@"
}

do_bench()
{
	case ${1:-} in
	cycle | record | dds)
		[ $# = 1 ] || usage_error "bench: $1 has no options"
		do_measure "$1"
		;;
	esac
	if python=$(find_python); then
		"$python" "$root/app/tools/bench.py" --check "$@"
	fi
	if [ "$1" = setup ]; then
		need_packages deb
		need_venv
		exec "$PYTHON" "$root/app/tools/bench.py" "$@"
	fi
	prepare_tests run
	want_packages bench "what else is measured with"
	build_flavour release
	exec "$PYTHON" "$root/app/tools/bench.py" "$@"
}

do_deb()
{
	"$root/app/tools/deb/build-deb.sh" --check "$@"
	case " $* " in
	*" arm64 "* | *" all "*) need_packages deb deb-arm64 ;;
	*) need_packages deb ;;
	esac
	exec "$root/app/tools/deb/build-deb.sh" "$@"
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

do_bundle()
{
	"$root/app/tools/image/build-bundle.sh" --check "$@"
	need_packages image
	PYTHON=$(find_python) || die "no Python 3.11 or newer with venv and ensurepip"
	export PYTHON
	exec "$root/app/tools/image/build-bundle.sh" "$@"
}

do_boot()
{
	"$root/app/tools/image/boot.sh" --check "$@"
	need_packages image
	exec "$root/app/tools/image/boot.sh" "$@"
}

verbs="run test build sim fuzz lint measure bench clean deb image bundle boot"
verb=${1:-help}
[ $# -eq 0 ] || shift
case $verb in
build | test | run | sim | fuzz | lint | measure | bench | clean | deb | image | bundle | boot)
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
	build | test | run | sim | fuzz | lint | measure | bench | clean | deb | image | bundle | boot | help) "help_${1:-help}" ;;
	*) usage_error "no verb '$1'; there are: $verbs help" ;;
	esac
	;;
*) usage_error "no verb '$verb'; there are: $verbs help" ;;
esac
