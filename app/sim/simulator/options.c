/* SPDX-License-Identifier: MIT */
#include "simulator/options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#include "simulator/list_slaves.h"

static const char usage_text[] =
	"usage: ecdaq-sim --interface NIC [OPTION...]\n"
	"\n"
	"A simulated EtherCAT segment on a network interface. Ends at SIGINT or SIGTERM.\n"
	"\n";

static const char notes_text[] =
	"\n"
	"slaves: names of --list-slaves, in the order of the line: ek1100,el2828,el3104; or a "
	"tree:\n"
	"  ek1100(el2828,el3104),ek1100(el2004): parentheses hold what hangs on port 1, (2:...) "
	"on\n"
	"  port 2, of the slave before them. wago_750_354+430+530 has these modules (default 457,\n"
	"  557, 430, 530); plant[:TAU_MS[:GAIN]] is a first-order lag (default plant:50:1)\n"
	"\n"
	"fault lines: WHEN WHAT [KEY=VALUE...]\n"
	"  WHEN   at=TIME [for=TIME], frame=N, every=N, p=CHANCE; times as 2s, 300us\n"
	"  WHAT   to frames: lose, drop, delay by=TIME, jitter by=TIME, mirror, hold, double,\n"
	"         truncate, corrupt, damage slave=N\n"
	"         to slaves (slave=N): cut, heal, power-off, power-on, reset, drift ppm=X,\n"
	"         al-error code=X, port-error port=N, watchdog, mailbox-stuck [for=TIME],\n"
	"         mailbox kind=late|double|counter|length|silent|eoe|abort|busy [count=N]\n"
	"         [by=TIME],\n"
	"         identity product=X, sync0-lost [count=N], unplug, plug [address=X],\n"
	"         slow [state=safeop] by=TIME, refuse [state=safeop] code=X, obey,\n"
	"         switch id=N\n"
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

static int parse_wander(const char *text, void *target, char *why)
{
	char *end;
	double ppm = strtod(text, &end);

	if (end == text || *end != '\0' || !(ppm >= 0 && ppm <= 100)) {
		snprintf(why, ARGS_WHY_BYTES, "expected a number from 0 to 100 (ppm)");
		return -ERANGE;
	}
	*(double *)target = ppm;
	return 0;
}

static int parse_signal(const char *text, void *target, char *why)
{
	int r = signal_parse(text, target);

	if (r < 0) {
		snprintf(why, ARGS_WHY_BYTES, "expected sine:HZ:V:OFFSET_V[:PHASE_DEG]");
	}
	return r;
}

void sim_options_read(int argc, char **argv, struct sim_options *opt)
{
	int must_list = 0;
	const struct args_option table[] = {
		{ "interface", 0, args_text, &opt->interface, "NIC",
		  "where the master is: a veth, a tap, a real NIC" },
		{ "slaves", 0, args_text, &opt->slaves, "WHAT",
		  "number of FB1111+Piccolo slaves (default 2), or names in the order of the line: "
		  "ek1100,el2828,el3104; see below" },
		{ "sii", 0, args_text, &opt->sii_dir, "DIR",
		  "folder of SII images of real slaves: NAME.bin is used instead of the "
		  "catalogue's NAME" },
		{ "list-slaves", 0, args_flag, &must_list, NULL,
		  "print the catalogue of slaves and exit" },
		{ "ppm", 0, args_text, &opt->ppm, "A,B,...",
		  "crystals of the slaves, ppm (default: seeded, +-50)" },
		{ "wander", 0, parse_wander, &opt->wander_ppm, "PPM",
		  "crystals drift within +-PPM (default 0.5)" },
		{ "jitter", 0, args_integer, &opt->jitter_ns, "NS",
		  "jitter of the time stamps of frames (default 10)" },
		{ "transit-jitter", 0, args_integer, &opt->transit_jitter_ns, "NS",
		  "each frame reaches the slaves later by 0 to NS (default 0)" },
		{ "signal", 0, parse_signal, &opt->signal, "SPEC",
		  "sine:HZ:V:OFFSET_V[:PHASE_DEG] at every ADC (default sine:1:0.5:1)" },
		{ "seed", 0, args_integer, &opt->seed, "N",
		  "seed of all random numbers (default 1)" },
		{ "faults", 0, args_text, &opt->faults, "FILE",
		  "fault plan, one fault per line; times count from the start" },
		{ "control", 0, args_text, &opt->control, "SOCKET",
		  "accept fault lines at run time, one per datagram, times count from its "
		  "arrival; the reply is \"ok\" or an error; or io lines, see below" },
		{ "edges", 0, args_text, &opt->edges, "FILE",
		  "write every SYNC0 edge: slave, CLOCK_MONOTONIC ns, DC ns; unbuffered if FILE "
		  "is a pipe (waits until it is opened for reading)" },
		{ "edges-keep", 0, args_integer, &opt->edges_keep_mib, "MIB",
		  "keep only the newest MIB of that file" },
		{ "priority", 0, args_integer, &opt->priority, "N", "SCHED_FIFO" },
		{ "cpu", 0, args_integer, &opt->cpu, "N", "run on this core only" },
	};
	const size_t count = sizeof(table) / sizeof(table[0]);
	struct args args = { .options = table, .option_count = count };
	char error[ARGS_ERROR_BYTES];

	switch (args_parse(&args, argc - 1, argv + 1, error)) {
	case ARGS_HELP:
		fputs(usage_text, stdout);
		args_help(stdout, table, count);
		args_help_common(stdout);
		fputs(notes_text, stdout);
		exit(0);
	case ARGS_VERSION:
		puts("ecdaq-sim " ECDAQ_VERSION);
		exit(0);
	case ARGS_ERROR:
		sim_error(error);
		exit(2);
	case ARGS_OK:
		break;
	}
	if (must_list) {
		exit(list_slaves() < 0 ? EXIT_FAILURE : EXIT_SUCCESS);
	}
	if (opt->interface == NULL) {
		sim_error("--interface is missing: name the NIC that the master is on");
		exit(2);
	}
}

struct sim_options sim_options_default(void)
{
	return (struct sim_options){
		.slaves = "2",
		.signal = signal_default(),
		.wander_ppm = 0.5,
		.jitter_ns = { .low = 0, .high = 10000, .value = 10 },
		.transit_jitter_ns = { .low = 0, .high = 1000000 },
		.seed = { .low = 0, .high = INT32_MAX, .value = 1 },
		.edges_keep_mib = { .low = 1, .high = 1 << 20 },
		.priority = { .low = 1, .high = 99 },
		.cpu = { .low = 0, .high = 1023, .value = -1 },
	};
}
