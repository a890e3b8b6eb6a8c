/* SPDX-License-Identifier: MIT */
#include "simulator/options.h"

#include <getopt.h> /* IWYU pragma: keep */
#include <stdio.h>
#include <stdlib.h>

#include "simulator/list_slaves.h"

static const char usage_text[] =
	"usage: ecdaq-sim --interface NIC [OPTION...]\n"
	"\n"
	"A simulated EtherCAT segment on a network interface. Ends at SIGINT or SIGTERM.\n"
	"\n"
	"  --interface NIC    where the master is: a veth, a tap, a real NIC\n"
	"  --slaves WHAT      1 to 64: number of FB1111+Piccolo slaves (default 2); or names, in\n"
	"                     the order of the line: ek1100,el2828,el3104. See --list-slaves.\n"
	"                     wago_750_354+430+530 has these modules (default 457, 557, 430,\n"
	"                     530); plant[:TAU_MS[:GAIN]] is a first-order lag (default\n"
	"                     plant:50:1)\n"
	"  --sii DIR          folder of SII images of real slaves: NAME.bin is used instead of\n"
	"                     the catalogue's NAME\n"
	"  --list-slaves      print the catalogue of slaves and exit\n"
	"  --ppm A,B,...      crystals of the slaves, ppm (default: seeded, +-50)\n"
	"  --wander PPM       crystals drift within +-PPM (default 0.5)\n"
	"  --jitter NS        jitter of the time stamps of frames (default 10)\n"
	"  --signal SPEC      sine:HZ:V:OFFSET_V[:PHASE_DEG] at every ADC (default sine:1:0.5:1)\n"
	"  --seed N           seed of all random numbers (default 1)\n"
	"  --faults FILE      fault plan, one fault per line; times count from the start\n"
	"  --control SOCKET   accept fault lines at run time, one per datagram, times count from\n"
	"                     its arrival; the reply is \"ok\" or an error; or io lines, see "
	"below\n"
	"  --edges FILE       write every SYNC0 edge: slave, CLOCK_MONOTONIC ns, DC ns; "
	"unbuffered\n"
	"                     if FILE is a pipe (waits until it is opened for reading)\n"
	"  --edges-keep MIB   keep only the newest MIB of that file\n"
	"  --priority N       SCHED_FIFO\n"
	"  --cpu N            run on this core only\n"
	"  --help, --version\n"
	"\n"
	"fault lines: WHEN WHAT [KEY=VALUE...]\n"
	"  WHEN   at=TIME [for=TIME], frame=N, every=N, p=CHANCE; times as 2s, 300us\n"
	"  WHAT   to frames: lose, drop, delay by=TIME, hold, double, truncate, corrupt,\n"
	"         damage slave=N\n"
	"         to slaves (slave=N): cut, heal, power-off, power-on, reset, drift ppm=X,\n"
	"         al-error code=X, port-error port=N, watchdog, mailbox-stuck [for=TIME],\n"
	"         identity product=X, sync0-lost [count=N], unplug, plug [address=X],\n"
	"         slow [state=safeop] by=TIME, refuse [state=safeop] code=X, obey\n"
	"\n"
	"io lines: io slave=N [KEY=VALUE...]\n"
	"         sets inputs of slave N and replies with the values at its terminals:\n"
	"         slot3=0x01, slot3.1=1 of a wago_750_354, 0x6000:01=1 of a slave of the\n"
	"         catalogue\n"
	"\n"
	"exit codes: 0 ended by a signal, 1 failed, 2 invalid options\n";

int sim_error(const char *what)
{
	fprintf(stderr, "ecdaq-sim: %s\n", what);
	return -1;
}

static int number_of(const char *text, const char *what, long low, long high, long *ret)
{
	char line[128];
	char *end;
	long v = strtol(text, &end, 0);

	if (end == text || *end != '\0' || v < low || v > high) {
		snprintf(line, sizeof(line), "%s: '%.40s' is not a number from %ld to %ld", what,
			 text, low, high);
		return sim_error(line);
	}
	*ret = v;
	return 0;
}

static int take_wander(const char *text, struct sim_options *opt)
{
	char *end;
	double ppm = strtod(text, &end);

	if (end == text || *end != '\0' || !(ppm >= 0 && ppm <= 100)) {
		return sim_error("--wander: expected a number from 0 to 100 (ppm)");
	}
	opt->wander_ppm = ppm;
	return 0;
}

static int take_option(int c, const char *value, struct sim_options *opt)
{
	long n = 0;

	switch (c) {
	case 'i':
		opt->interface = value;
		return 0;
	case 'n':
		opt->slaves = value;
		return 0;
	case 'd':
		opt->sii_dir = value;
		return 0;
	case 'p':
		opt->ppm = value;
		return 0;
	case 'f':
		opt->faults = value;
		return 0;
	case 'c':
		opt->control = value;
		return 0;
	case 'e':
		opt->edges = value;
		return 0;
	case 'k':
		if (number_of(value, "--edges-keep", 1, 1 << 20, &n) < 0) {
			return -1;
		}
		opt->edges_keep_bytes = (uint64_t)n << 20;
		return 0;
	case 'g':
		return signal_parse(value, &opt->signal) < 0
			       ? sim_error("--signal: expected sine:HZ:V:OFFSET_V[:PHASE_DEG]")
			       : 0;
	case 'j':
		if (number_of(value, "--jitter", 0, 10000, &n) < 0) {
			return -1;
		}
		opt->jitter_ns = n;
		return 0;
	case 'w':
		return take_wander(value, opt);
	case 's':
		if (number_of(value, "--seed", 0, INT32_MAX, &n) < 0) {
			return -1;
		}
		opt->seed = (uint64_t)n;
		return 0;
	case 'r':
		if (number_of(value, "--priority", 1, 99, &n) < 0) {
			return -1;
		}
		opt->priority = (int)n;
		return 0;
	case 'u':
		if (number_of(value, "--cpu", 0, 1023, &n) < 0) {
			return -1;
		}
		opt->cpu = (int)n;
		return 0;
	default:
		return -1;
	}
}

void sim_options_read(int argc, char **argv, struct sim_options *opt)
{
	static const struct option table[] = {
		{ "interface", required_argument, NULL, 'i' },
		{ "slaves", required_argument, NULL, 'n' },
		{ "sii", required_argument, NULL, 'd' },
		{ "list-slaves", no_argument, NULL, 'l' },
		{ "ppm", required_argument, NULL, 'p' },
		{ "wander", required_argument, NULL, 'w' },
		{ "jitter", required_argument, NULL, 'j' },
		{ "signal", required_argument, NULL, 'g' },
		{ "seed", required_argument, NULL, 's' },
		{ "faults", required_argument, NULL, 'f' },
		{ "control", required_argument, NULL, 'c' },
		{ "edges", required_argument, NULL, 'e' },
		{ "edges-keep", required_argument, NULL, 'k' },
		{ "priority", required_argument, NULL, 'r' },
		{ "cpu", required_argument, NULL, 'u' },
		{ "help", no_argument, NULL, 'h' },
		{ "version", no_argument, NULL, 'v' },
		{ NULL, 0, NULL, 0 },
	};
	int c;

	while ((c = getopt_long(argc, argv, "", table, NULL)) != -1) {
		if (c == 'h') {
			fputs(usage_text, stdout);
			exit(0);
		}
		if (c == 'l') {
			exit(list_slaves() < 0 ? EXIT_FAILURE : EXIT_SUCCESS);
		}
		if (c == 'v') {
			puts("ecdaq-sim " ECDAQ_VERSION);
			exit(0);
		}
		if (c == '?' || take_option(c, optarg, opt) < 0) {
			exit(2);
		}
	}
	if (optind < argc) {
		sim_error("unexpected argument: see --help");
		exit(2);
	}
	if (opt->interface == NULL) {
		sim_error("--interface is missing: name the NIC that the master is on");
		exit(2);
	}
}
