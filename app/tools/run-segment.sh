#!/bin/bash
# SPDX-License-Identifier: MIT
# A simulated segment and the whole of ecdaq on it, in a network namespace of their own.
# `./build.sh run` builds and then calls this.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)

usage()
{
	cat <<'USAGE'
usage: ./build.sh run [OPTION...]

Brings a simulated segment to OP over a veth pair in a network namespace of its own, records every
cycle, publishes it over DDS, checks the SYNC0 pulses and shows it live. Ctrl-C ends it in order (ecdaqd, recorder, segment)
and prints a summary.
It needs no privilege where the kernel grants users their own namespaces; real-time priority is then
not to be had, and ecdaqd says so once.

  --seconds N     end after N seconds in OP (default: at Ctrl-C)
  --slaves WHAT   1 to 64: number of FB1111+Piccolo slaves; or names, in the order of the line, of the catalogue
                  (build/stage/bin/ecdaq-sim --list-slaves): ek1100,el2828,el3104 (default: 2)
  --sii DIR       folder of SII images of real slaves, used instead of the catalogue (default: $ECDAQ_SII)
  --config FILE   ecdaq.yaml for ecdaqd and ecdaq-record (default: built-in defaults)
  --record DIR    where recordings go (default: build/run/record)
  --no-dds        without ecdaq-dds. Else it publishes on this machine's loopback, in a domain and with a
                  tag of its own (one line says which); where FILE has a section dds, as that says
  --no-sync0      without ecdaq-sync0. Else it checks the simulated pulses, marked as such in `ecdaq sync0`; where section
                  sync0 of FILE has enable or edges, it does as that says
  --json          no live view; the last line printed is `ecdaq status --json --summary`

environment:
  ECDAQ_BIN_DIR  folder of the programs (default: build/stage/bin)
  ECDAQ_RUN_DIR  run directory: rings, status, admin socket (default: a new one in /dev/shm, removed
                 at the end). With it set, `ecdaq` in a second terminal reads what runs here, and
                 app/tools/tell-segment.py sets inputs of the simulated slaves, or makes faults.
  ECDAQ_SII      as --sii
USAGE
}

die()
{
	printf 'build.sh: run: %s\n' "$*" >&2
	exit 1
}

note()
{
	printf -- '-- %s\n' "$*" >&2
}

# The highest domain: nobody's by default, and no ports that the kernel gives away.
private_domain=230
seconds=
slaves=2
sii=${ECDAQ_SII:-}
config=
record=$root/build/run/record
json=no
dds=yes
sync0=yes
mode=outside
bin=${ECDAQ_BIN_DIR:-$root/build/stage/bin}

parse_options()
{
	while [ $# -gt 0 ]; do
		case $1 in
		--seconds | --slaves | --sii | --config | --record)
			[ $# -ge 2 ] || die "$1 needs a value"
			printf -v "${1#--}" '%s' "$2"
			shift
			;;
		--json) json=yes ;;
		--no-dds) dds=no ;;
		--no-sync0) sync0=no ;;
		--check) mode=check ;;
		--inside) mode=inside ;;
		--help)
			usage
			exit 0
			;;
		*) die "unknown option '$1' (see ./build.sh help run)" ;;
		esac
		shift
	done
}

check_options()
{
	case $seconds in
	*[!0-9]* | 0) die "--seconds: '$seconds' is no number of seconds above 0" ;;
	esac
	case $slaves in
	'') die "--slaves: nothing given" ;;
	*[!0-9]*)
		[ -z "$sii" ] || [ -d "$sii" ] || die "--sii: $sii: no such folder"
		;;
	*)
		if [ "${#slaves}" -gt 2 ] || [ "$slaves" -lt 1 ] || [ "$slaves" -gt 64 ]; then
			die "--slaves: $slaves is not 1 to 64"
		fi
		;;
	esac
	[ -z "$seconds" ] || daemon_options+=(--seconds "$seconds")
	[ -z "$config" ] || [ -r "$config" ] || die "--config: $config: cannot be read"
}

# ecdaq-dds stays outside of the namespace, where others can subscribe: it needs nothing of the
# segment but the run directory. It is a child of this process, which goes on as the one inside.
start_dds()
{
	local options=(--config "$config") why

	[ "$dds" = yes ] || return 0
	if [ ! -x "$bin/ecdaq-dds" ]; then
		note "no DDS: ecdaq-dds is not there (app/doc/reference/dds.md says what it needs to be built)"
		return 0
	fi
	if [ -z "$config" ] || ! grep -q '^dds:' "$config"; then
		options=(--set dds.enable=on --set dds.interface=lo --set dds.multicast=off
			--set "dds.domain=$private_domain" --set "dds.tag=run-$$")
		[ -z "$config" ] || options=(--config "$config" "${options[@]}")
	fi
	if ! why=$("$bin/ecdaq-dds" --check "${options[@]}" 2>&1); then
		note "no DDS: ${why##*$'\n'}"
		return 0
	fi
	setpriv --pdeathsig TERM setsid "$bin/ecdaq-dds" "${options[@]}" < /dev/null &
	export run_dds_pid=$!
	[[ ${options[*]} != *dds.tag=run-$$ ]] ||
		note "DDS: ecdaq-remote --interface lo --domain $private_domain --tag run-$$ watch"
}

enter_namespace()
{
	local how=(unshare --net)

	[ "$(id -u)" = 0 ] || how=(unshare --user --map-root-user --net)
	"${how[@]}" true 2> /dev/null ||
		die "this kernel grants no network namespace to user $(id -un): run it as root"
	if [ -z "${ECDAQ_RUN_DIR:-}" ]; then
		ECDAQ_RUN_DIR=$(mktemp -d /dev/shm/ecdaq-run-XXXXXX)
		export ECDAQ_RUN_DIR run_dir_is_own=yes
	fi
	mkdir -p "$ECDAQ_RUN_DIR"
	start_dds
	exec "${how[@]}" "$0" --inside "$@"
}

# Frames of type 0x88A4 only: no IPv6 chatter, no checksum or segmentation offload.
make_wire()
{
	local nic

	ip link add ecat0 type veth peer name ecsim0
	for nic in ecat0 ecsim0; do
		echo 1 > "/proc/sys/net/ipv6/conf/$nic/disable_ipv6" 2> /dev/null || true
		if command -v ethtool > /dev/null; then
			ethtool -K "$nic" rx off tx off sg off gso off gro off tso off > /dev/null 2>&1 || true
		fi
		ip link set "$nic" arp off multicast off up
	done
}

declare -A pid=()

# start NAME COMMAND...: in a session of its own, so that Ctrl-C reaches this script only; ended with
# this script if it is killed.
start()
{
	local name=$1

	shift
	setpriv --pdeathsig TERM setsid "$@" <&3 &
	pid[$name]=$!
}

# stop NAME: end it by SIGTERM and wait. Its exit code is kept in failed if it is none of ours.
stop()
{
	local name=$1 status=0

	[ -n "${pid[$name]:-}" ] || return 0
	kill -TERM "${pid[$name]}" 2> /dev/null || true
	# One that is stopped (job control) could not end.
	kill -CONT "${pid[$name]}" 2> /dev/null || true
	wait "${pid[$name]}" || status=$?
	unset "pid[$name]"
	case $status in
	0 | 143) ;;
	*)
		note "$name ended with $status"
		# Who only looks on does not spoil the run.
		[ "$name" = sync0 ] || failed=1
		;;
	esac
}

# The live view stays in this process group: Ctrl-Z and fg reach it, too.
start_view()
{
	setpriv --pdeathsig TERM "$bin/ecdaq" top --leave-text 'q: stop master, segment and recorder' <&3 &
	pid[view]=$!
	trap suspend TSTP
}

# Ctrl-Z: the view gives the terminal back before this script stops, and with it the job of the shell.
suspend()
{
	local state tries

	for ((tries = 0; tries < 100; tries++)); do
		state=$(awk '/^State:/ { print $2 }' "/proc/${pid[view]:-none}/status" 2> /dev/null) || break
		[[ $state != [TZ] ]] || break
		sleep 0.02
	done
	trap - TSTP
	kill -TSTP "$$"
	trap suspend TSTP
}

# Does the configuration itself say what ecdaq-sync0 has to look at?
has_sync0_source()
{
	[ -n "$config" ] && awk '
		/^[^ \t#-]/ { is_in = /^sync0:/ }
		is_in && /[ \t{,](enable|edges)[ \t]*:/ { found = 1 }
		END { exit !found }' "$config"
}

start_sync0()
{
	local options=()

	[ "$sync0" = yes ] || return 0
	if [ ! -x "$bin/ecdaq-sync0" ]; then
		note "no check of SYNC0: ecdaq-sync0 is not there"
		return 0
	fi
	[ -z "$config" ] || options=(--config "$config")
	has_sync0_source || options+=(--edges "$ECDAQ_RUN_DIR/edges")
	start sync0 "$bin/ecdaq-sync0" "${options[@]}"
}

# ecdaq-dds was started before this shell: tail stands in for it, and ends when it does.
adopt_dds()
{
	[ -n "${run_dds_pid:-}" ] || return 0
	setsid tail --pid="$run_dds_pid" -s 0.1 -f /dev/null &
	pid[dds]=$!
}

stop_dds()
{
	[ -n "${pid[dds]:-}" ] || return 0
	kill -TERM "$run_dds_pid" 2> /dev/null || true
	wait "${pid[dds]}" || true
	unset 'pid[dds]'
}

failed=0
interrupted=no

end_in_order()
{
	trap '' TSTP
	stop view
	stop sync0
	stop daemon
	stop recorder
	stop_dds
	stop segment
	trap '' INT TERM
	stop interrupt
}

clean_up()
{
	trap '' INT TERM
	end_in_order
	rm -f "$ECDAQ_RUN_DIR/edges"
	[ -z "${run_dir_is_own:-}" ] || rm -rf "$ECDAQ_RUN_DIR"
}

# A signal that comes before "wait" is in it would be waited over: this child's end is waited for, too.
start_interruptible()
{
	setpriv --pdeathsig TERM setsid sleep infinity <&3 &
	pid[interrupt]=$!
	trap 'interrupted=yes; kill "${pid[interrupt]}" 2> /dev/null || true' INT TERM
}

# Which of the children ended? Waits for the first, ecdaq-sync0 apart: the run goes on without it.
wait_for_end()
{
	local ended status

	while :; do
		status=0
		ended=''
		[ "$interrupted" = no ] || return 0
		wait -n -p ended "${pid[@]}" || status=$?
		[ "$interrupted" = no ] || return 0
		[ -n "${ended:-}" ] || continue # suspended, and resumed
		[ "$ended" = "${pid[sync0]:-none}" ] || break
		unset 'pid[sync0]'
		[ "$status" = 0 ] || note "ecdaq-sync0 ended with $status"
	done
	for name in "${!pid[@]}"; do
		[ "${pid[$name]}" = "$ended" ] || continue
		case $name in
		view) ;;
		daemon) [ -n "$seconds" ] || note "ecdaqd ended by itself" ;;
		*)
			note "$name ended by itself"
			failed=1
			;;
		esac
	done
}

run_inside()
{
	local set_options=(--set bus.interface=ecat0 --set "record.dir=$record")
	local daemon_options=(--simulated)
	local segment_options=(--interface ecsim0 --slaves "$slaves" --control "$ECDAQ_RUN_DIR/segment")

	[ "$sync0" = no ] || segment_options+=(--edges "$ECDAQ_RUN_DIR/edges" --edges-keep 8)

	# As root the segment gets a real-time priority below the master's: it stands for hardware.
	! chrt -f 1 true 2> /dev/null || segment_options+=(--priority 50)
	[ -z "$sii" ] || segment_options+=(--sii "$sii")
	[ -z "$seconds" ] || daemon_options+=(--seconds "$seconds")
	[ -z "$config" ] || set_options=(--config "$config" "${set_options[@]}")
	mkdir -p "$record"
	exec 3<&0
	trap clean_up EXIT
	start_interruptible
	make_wire
	start segment "$bin/ecdaq-sim" "${segment_options[@]}"
	start recorder "$bin/ecdaq-record" "${set_options[@]}"
	start daemon "$bin/ecdaqd" "${set_options[@]}" "${daemon_options[@]}"
	start_sync0
	adopt_dds
	if [ "$json" = no ] && [ -t 1 ]; then
		start_view
	fi
	wait_for_end
	end_in_order
	if [ "$json" = yes ]; then
		"$bin/ecdaq" status --json --summary || failed=1
	else
		"$bin/ecdaq" status --summary || failed=1
	fi
	exit "$failed"
}

parse_options "$@"
check_options
case $mode in
check) ;;
inside) run_inside ;;
outside) enter_namespace "$@" ;;
esac
