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

Brings a simulated segment to OP over a veth pair in its own network namespace, records every cycle,
publishes it over DDS, serves it to browsers and Foxglove viewers, checks the SYNC0 pulses and shows it
live. Ctrl-C stops ecdaqd, recorder and
segment in this order, prints a summary and where the recording is.
It needs no privilege where the kernel grants users network namespaces; ecdaqd then runs without
real-time priority and reports that once.

  --seconds N     stop after N seconds in OP (default: at Ctrl-C)
  --slaves WHAT   1 to 512: number of FB1111+Piccolo slaves; or names, in the order of the line, or as a tree, of the catalogue
                  (build/stage/bin/ecdaq-sim --list-slaves): ek1100,el2828,el3104 (default: 2)
  --sii DIR       folder of SII images of real slaves, used instead of the catalogue (default: $ECDAQ_SII)
  --config FILE   ecdaq.yaml for ecdaqd and ecdaq-record (default: built-in defaults)
  --record DIR    folder of the recordings (default: build/run/record)
  --no-dds        do not start ecdaq-dds. Without this option it publishes on the loopback interface,
                  in a domain and with a tag of its own (printed at start), or as section dds of
                  FILE configures
  --no-sync0      do not start ecdaq-sync0. Without this option it checks the simulated pulses, marked
                  as simulated in `ecdaq sync0`, or what section sync0 of FILE names (enable, edges)
  --no-web        do not start ecdaq-web. Without this option it listens on 127.0.0.1, on the first free
                  port from 8765 on (the address is printed at start, and one with a token that logs an
                  operator in, once), or as section web of FILE configures
  --json          no live view; the last line of standard output is `ecdaq status --json --summary`;
                  there is none if the start failed

exit codes: 0 stopped as requested, 1 failed (the last line of standard error is the cause),
2 wrong command line, 130 and 143 ended by SIGINT and SIGTERM before the segment was started

environment:
  ECDAQ_BIN_DIR  folder of the programs (default: build/stage/bin)
  ECDAQ_RUN_DIR  run directory: rings, status, admin socket; used by one run at a time (default: a new
                 /dev/shm/ecdaq-run-*, removed at the end). In a second terminal `ecdaq` reads this
                 run, and app/tools/tell-segment.py sets inputs of the simulated slaves or
                 injects faults.
  ECDAQ_SII      as --sii
USAGE
}

die()
{
	printf 'build.sh: run: %s\n' "$*" >&2
	exit 1
}

usage_error()
{
	printf 'build.sh: run: %s\n' "$*" >&2
	exit 2
}

note()
{
	printf -- '-- %s\n' "$*" >&2
}

# The highest domain: not a default of any DDS, and below the kernel's ephemeral ports.
private_domain=230
seconds=
slaves=2
sii=${ECDAQ_SII:-}
config=
record=$root/build/run/record
json=no
dds=yes
web=yes
sync0=yes
mode=outside
bin=${ECDAQ_BIN_DIR:-$root/build/stage/bin}
# As one types it here.
tool=${bin#"$PWD/"}/ecdaq

parse_options()
{
	while [ $# -gt 0 ]; do
		case $1 in
		--seconds | --slaves | --sii | --config | --record)
			[ $# -ge 2 ] || usage_error "$1 needs a value"
			printf -v "${1#--}" '%s' "$2"
			shift
			;;
		--json) json=yes ;;
		--no-dds) dds=no ;;
		--no-web) web=no ;;
		--no-sync0) sync0=no ;;
		--check) mode=check ;;
		--inside) mode=inside ;;
		--help)
			usage
			exit 0
			;;
		*) usage_error "unknown option '$1' (see ./build.sh help run)" ;;
		esac
		shift
	done
}

check_options()
{
	case $seconds in
	*[!0-9]* | 0) usage_error "--seconds: '$seconds' is not a number of seconds above 0" ;;
	esac
	case $slaves in
	'') usage_error "--slaves: nothing given" ;;
	*[!0-9]*)
		[ -z "$sii" ] || [ -d "$sii" ] || usage_error "--sii: $sii: no such directory"
		;;
	*)
		if [ "${#slaves}" -gt 3 ] || [ "$slaves" -lt 1 ] || [ "$slaves" -gt 512 ]; then
			usage_error "--slaves: $slaves is not 1 to 512"
		fi
		;;
	esac
	[ -z "$seconds" ] || daemon_options+=(--seconds "$seconds")
	[ -z "$config" ] || [ -r "$config" ] || usage_error "--config: $config: cannot be read"
}

# ecdaq-dds runs outside the namespace, where others can subscribe: all it needs is the run directory.
# It is a child of this process, which continues inside by exec.
start_dds()
{
	local options=(--config "$config") why

	[ "$dds" = yes ] || return 0
	if [ ! -x "$bin/ecdaq-dds" ]; then
		note "no DDS: ecdaq-dds is not built (app/doc/reference/dds.md names the packages it needs)"
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
	setpriv --pdeathsig TERM setsid "$bin/ecdaq-dds" "${options[@]}" < /dev/null 2<> "$run_work/pipe" &
	export run_dds_pid=$!
	[[ ${options[*]} != *dds.tag=run-$$ ]] ||
		note "DDS: ecdaq-remote --interface lo --domain $private_domain --tag run-$$ watch"
}

# The first port from 8765 on that nobody listens on.
free_web_port()
{
	local port

	for port in 8765 8766 8767 8768 8769 8770 8771 8772 8773 8774; do
		if ! (: < "/dev/tcp/127.0.0.1/$port") 2> /dev/null; then
			printf '%s\n' "$port"
			return 0
		fi
	done
	return 1
}

# start_web_command OPTION...: log-in and commands of the page. Sets $token to one that logs an operator in.
start_web_command()
{
	local tries=0

	if [ ! -x "$bin/ecdaq-web-command" ]; then
		return 0
	fi
	setpriv --pdeathsig TERM setsid "$bin/ecdaq-web-command" "$@" < /dev/null 2<> "$run_work/pipe" &
	export run_web_command_pid=$!
	until [ -S "$ECDAQ_RUN_DIR/web-command/token" ] || [ "$tries" -ge 250 ]; do
		tries=$((tries + 1))
		sleep 0.02
	done
	token=$("$bin/ecdaq" --run-dir "$ECDAQ_RUN_DIR" web-token operator) || token=
}

# ecdaq-web listens outside the namespace, too.
start_web()
{
	local options=(--config "$config") port='' token='' why

	[ "$web" = yes ] || return 0
	if [ ! -x "$bin/ecdaq-web" ]; then
		note "no page: ecdaq-web is not built (app/doc/reference/web.md names the packages it needs)"
		return 0
	fi
	if [ -z "$config" ] || ! grep -q '^web:' "$config"; then
		if ! port=$(free_web_port); then
			note "no page: ports 8765 to 8774 of 127.0.0.1 are in use"
			return 0
		fi
		options=(--set web.enable=on --set web.listen=loopback --set "web.port=$port")
		[ -z "$config" ] || options=(--config "$config" "${options[@]}")
	fi
	options+=(--set "record.dir=$record") # --record may say another one
	if ! why=$("$bin/ecdaq-web" --check "${options[@]}" 2>&1); then
		note "no page: ${why##*$'\n'}"
		return 0
	fi
	setpriv --pdeathsig TERM setsid "$bin/ecdaq-web" "${options[@]}" < /dev/null 2<> "$run_work/pipe" &
	export run_web_pid=$!
	start_web_command "${options[@]}"
	[ -z "$port" ] || note "page: http://127.0.0.1:$port/ (Foxglove: ws://127.0.0.1:$port/)"
	[ -z "$port" ] || [ -z "$token" ] ||
		note "page with a log-in, once and within 10 min, as operator: http://127.0.0.1:$port/#token=$token"
}

# Directories of earlier runs that were killed: no process holds their lock any more.
remove_abandoned_run_dirs()
{
	local dir

	find /dev/shm -maxdepth 1 -name 'ecdaq-run-*' -type d -uid "$(id -u)" -mmin +1 -print0 2> /dev/null |
		while IFS= read -r -d '' dir; do
			[ ! -e "$dir/run.lock" ] || flock -n "$dir/run.lock" rm -rf "$dir" || true
		done
}

enter_namespace()
{
	local how=(unshare --net)

	[ "$(id -u)" = 0 ] || how=(unshare --user --map-root-user --net)
	"${how[@]}" true 2> /dev/null ||
		die "this kernel grants no network namespace to user $(id -un): run it as root"
	if [ -z "${ECDAQ_RUN_DIR:-}" ]; then
		remove_abandoned_run_dirs
		ECDAQ_RUN_DIR=$(mktemp -d /dev/shm/ecdaq-run-XXXXXX)
		export ECDAQ_RUN_DIR run_dir_is_own=yes
	fi
	mkdir -p "$ECDAQ_RUN_DIR"
	# Held open by all that is started here, so one run at a time uses a run directory.
	exec 8> "$ECDAQ_RUN_DIR/run.lock"
	flock -n 8 || die "$ECDAQ_RUN_DIR: another run uses this directory: stop it, or set another ECDAQ_RUN_DIR"
	note "starting; in a second terminal: $tool --run-dir $ECDAQ_RUN_DIR status"
	run_work=$(mktemp -d)
	export run_work
	mkfifo "$run_work/pipe"
	start_dds
	start_web
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

declare -A pid=() program=(
	[daemon]=ecdaqd [recorder]=ecdaq-record [segment]=ecdaq-sim [sync0]=ecdaq-sync0 [dds]=ecdaq-dds
	[web]=ecdaq-web [webcommand]=ecdaq-web-command [view]=ecdaq
)
view=no
cause=

# What the programs report through $run_work/pipe is kept in $run_work/messages and shown: at once, or,
# where the live view has the terminal, after it has ended.
open_messages()
{
	if [ "$json" = no ] && [ -t 1 ]; then
		view=yes
		setsid cat < "$run_work/pipe" > "$run_work/messages" 4>&- &
	else
		setsid tee "$run_work/messages" < "$run_work/pipe" >&2 &
	fi
	messages_pid=$!
	exec 4> "$run_work/pipe"
}

close_messages()
{
	[ -n "${messages_pid:-}" ] || return 0
	exec 4>&-
	wait "$messages_pid" || true
	messages_pid=
	[ "$view" = no ] || cat "$run_work/messages" >&2
}

# start NAME COMMAND...: in a session of its own, so that Ctrl-C reaches this script only; ended with
# this script if it is killed.
start()
{
	local name=$1

	shift
	setpriv --pdeathsig TERM setsid "$@" <&3 2>&4 4>&- 5>&- &
	pid[$name]=$!
}

# failure NAME HOW: the first one is the cause of all others; its program's last message has the details.
failure()
{
	failed=1
	[ -n "$cause" ] || cause="$1 $2" cause_program=$1
}

# stop NAME: end it by SIGTERM and wait. An exit code that is not that of an orderly end fails the run.
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
		# A check or a view that fails does not fail what it shows.
		if [ "$name" = sync0 ]; then
			note "ecdaq-sync0 ended with $status"
		else
			failure "${program[$name]}" "ended with $status"
		fi
		;;
	esac
}

# The live view stays in this process group: Ctrl-Z and fg reach it, too. It gives the terminal back
# before it stops; the trap keeps this script from stopping before that, and with it the job of the shell.
start_view()
{
	trap ':' TSTP
	setpriv --pdeathsig TERM "$bin/ecdaq" top --leave-text 'q: stop master, segment and recorder' <&3 4>&- 5>&- &
	pid[view]=$!
}

is_view_stopped()
{
	local key state rest

	while read -r key state rest; do
		[ "$key" != State: ] || break
	done 2> /dev/null < "/proc/${pid[view]:-none}/status" || return 1
	[ "${state:-}" = T ]
}

# Does the configuration itself name what ecdaq-sync0 checks?
has_sync0_source()
{
	[ -n "$config" ] && awk '
		/^[^ \t#-]/ { is_in = /^sync0:/ }
		is_in && /[ \t{,](enable|edges)[ \t]*:/ { found = 1 }
		END { exit !found }' "$config"
}

# start_sync0 yes|no: is there a source in the configuration?
start_sync0()
{
	local has_source=$1 options=()

	[ "$sync0" = yes ] || return 0
	if [ ! -x "$bin/ecdaq-sync0" ]; then
		note "no check of SYNC0: ecdaq-sync0 is not built"
		return 0
	fi
	[ -z "$config" ] || options=(--config "$config")
	if [ "$has_source" = yes ]; then
		start sync0 "$bin/ecdaq-sync0" "${options[@]}"
	else
		# ecdaq-sim makes this file when it starts.
		# shellcheck disable=SC2016 # expanded by the inner shell
		start sync0 sh -c 'until [ -e "$0" ]; do sleep 0.02; done; exec "$@" --edges "$0"' \
			"$ECDAQ_RUN_DIR/edges" "$bin/ecdaq-sync0" "${options[@]}"
	fi
}

# adopt NAME PID: what was started outside is not a child of this shell: a tail that ends with it takes
# its place.
adopt()
{
	[ -n "$2" ] || return 0
	setsid tail --pid="$2" -s 0.1 -f /dev/null 4>&- 5>&- &
	pid[$1]=$!
}

# stop_adopted NAME PID
stop_adopted()
{
	[ -n "${pid[$1]:-}" ] || return 0
	kill -TERM "$2" 2> /dev/null || true
	wait "${pid[$1]}" || true
	unset "pid[$1]"
}

failed=0
interrupted=no

end_in_order()
{
	trap '' INT TERM TSTP
	stop view
	stop sync0
	stop daemon
	stop recorder
	stop_adopted dds "${run_dds_pid:-}"
	stop_adopted web "${run_web_pid:-}"
	stop_adopted webcommand "${run_web_command_pid:-}"
	stop segment
}

clean_up()
{
	end_in_order
	rm -rf "$ECDAQ_RUN_DIR/edges" "$run_work"
	[ -z "${run_dir_is_own:-}" ] || rm -rf "$ECDAQ_RUN_DIR"
}

# has_ended NAME: sets $status to its exit code.
has_ended()
{
	! kill -0 "${pid[$1]}" 2> /dev/null || return 1
	status=0
	wait "${pid[$1]}" || status=$?
}

# Returns when the first of the children has ended, except ecdaq-sync0, ecdaq-web and ecdaq-web-command: the run
# continues without them. It
# polls instead of waiting: a signal during "wait -n" can make bash lose the end of a child.
wait_for_end()
{
	local name status

	while [ "$interrupted" = no ]; do
		read -r -t 0.2 -u 5 || true
		# Without a command that another Ctrl-Z would stop: this script would wait for it.
		! is_view_stopped || kill -STOP "$$"
		for name in "${!pid[@]}"; do
			has_ended "$name" || continue
			# A signal for all of the group: it may have ended before this shell saw its own.
			[ "$interrupted" = no ] || return 0
			case $name$status in
			sync0*)
				unset 'pid[sync0]'
				[ "$status" = 0 ] || note "ecdaq-sync0 ended with $status"
				continue
				;;
			webcommand*)
				unset 'pid[webcommand]'
				note "ecdaq-web-command has ended: the page has no commands any more"
				continue
				;;
			web*)
				unset 'pid[web]'
				note "ecdaq-web has ended: there is no page any more"
				continue
				;;
			view* | daemon0) ;;
			*0 | dds*) failure "${program[$name]}" "ended by itself" ;;
			*) failure "${program[$name]}" "ended with $status" ;;
			esac
			return 0
		done
	done
}

# The status page of another ecdaqd, or of an earlier run, is not the summary of this one.
is_own_page()
{
	[[ $page == *"\"pid\":$daemon_pid,"* ]]
}

print_end()
{
	local page recording message

	page=$("$bin/ecdaq" status --json --summary 2> /dev/null) || page=
	# A failed start has no result, only a cause.
	if [ -z "$cause" ] || { is_own_page && [[ $page != *'"samples_good":0,'* ]]; }; then
		if [ "$json" = yes ]; then
			printf '%s\n' "$page"
			[ -n "$page" ] || failed=1
		else
			"$bin/ecdaq" status --summary || failed=1
		fi
		recording=$(sed -n 's/.*"recording":"\([^"]*\)".*/\1/p' <<< "$page")
		if [ -n "$recording" ]; then
			note "recorded in $record; to look at it: $tool log list --dir $record"
			note "as a table: $tool log export $recording --output FILE.csv"
		fi
	fi
	if [ -n "$cause" ]; then
		message=$(sed -n "s/^$cause_program: //p" "$run_work/messages" | tail -n 1)
		die "$cause${message:+: $message}"
	fi
}

run_inside()
{
	local set_options=(--set bus.interface=ecat0 --set "record.dir=$record")
	local daemon_options=(--simulated)
	local segment_options=(--interface ecsim0 --slaves "$slaves" --control "$ECDAQ_RUN_DIR/segment")
	local has_source=no

	trap clean_up EXIT
	trap 'exit 130' INT
	trap 'exit 143' TERM
	[ "$sync0" = no ] || segment_options+=(--edges "$ECDAQ_RUN_DIR/edges" --edges-keep 8)

	# As root the segment gets a real-time priority below the master's: it replaces hardware.
	! chrt -f 1 true 2> /dev/null || segment_options+=(--priority 50)
	[ -z "$sii" ] || segment_options+=(--sii "$sii")
	[ -z "$seconds" ] || daemon_options+=(--seconds "$seconds")
	[ -z "$config" ] || set_options=(--config "$config" "${set_options[@]}")
	mkdir -p "$record"
	exec 3<&0
	open_messages
	make_wire
	! has_sync0_source || has_source=yes
	# Nothing is ever written into it: wait_for_end sleeps in a read with a time limit.
	mkfifo "$run_work/idle"
	exec 5<> "$run_work/idle"
	# From here to end_in_order no command runs in the foreground: Ctrl-C would end it, and its failure
	# this script, without a summary.
	trap 'interrupted=yes' INT TERM
	start segment "$bin/ecdaq-sim" "${segment_options[@]}"
	start recorder "$bin/ecdaq-record" "${set_options[@]}"
	if [ "$view" = yes ]; then
		start daemon "$bin/ecdaqd" --exit-on-failure "${set_options[@]}" "${daemon_options[@]}" >&4
		start_view
	else
		start daemon "$bin/ecdaqd" --exit-on-failure "${set_options[@]}" "${daemon_options[@]}"
	fi
	daemon_pid=${pid[daemon]}
	adopt dds "${run_dds_pid:-}"
	adopt web "${run_web_pid:-}"
	adopt webcommand "${run_web_command_pid:-}"
	start_sync0 "$has_source"
	wait_for_end
	end_in_order
	close_messages
	print_end
	exit "$failed"
}

parse_options "$@"
check_options
case $mode in
check) ;;
inside) run_inside ;;
outside) enter_namespace "$@" ;;
esac
