/* SPDX-License-Identifier: MIT */
/* ecdaq, the operator's tool: a table of verbs. */
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/args.h"
#include "cli/cli.h"
#include "cli/screen.h"
#include "cli/selection.h"
#include "program/beside.h"
#include "program/exit_code.h"

enum { PROGRAM_NAME_BYTES = 64 };

static enum exit_code verb_version(struct cli *cli, int argc, char **argv)
{
	struct args args = { .options = NULL };
	enum exit_code result;

	if (cli_parse(cli, &args, argc, argv, &result)) {
		puts("ecdaq " ECDAQ_VERSION);
		result = EXIT_CODE_OK;
	}
	return result;
}

/* A verb that is a program of its own, ecdaq-VERB, so that this one needs no libraries for it. */
static enum exit_code verb_program(struct cli *cli, int argc, char **argv)
{
	char name[PROGRAM_NAME_BYTES];
	char path[PATH_MAX];
	char run_dir[sizeof("--run-dir=") + CONFIG_PATH_BYTES];
	char config[sizeof("--config=") + PATH_MAX];
	char **words = calloc((size_t)argc + 4, sizeof(*words));
	int count = 0;
	int r;

	snprintf(name, sizeof(name), "ecdaq-%s", cli->verb->name);
	r = words == NULL ? -ENOMEM : program_beside(name, path);
	if (r == 0) {
		words[count++] = path;
		if (cli->run_dir != NULL) {
			snprintf(run_dir, sizeof(run_dir), "--run-dir=%s", cli->run_dir);
			words[count++] = run_dir;
		}
		if (cli->config != NULL) {
			snprintf(config, sizeof(config), "--config=%s", cli->config);
			words[count++] = config;
		}
		memcpy(words + count, argv, (size_t)argc * sizeof(*words));
		execv(path, words);
		r = -errno;
	}
	free(words);
	return r == -ENOENT ? cli_fail(cli, EXIT_CODE_FAILED, "%s: not installed", path)
			    : cli_fail(cli, EXIT_CODE_FAILED, "%s", strerror(-r));
}

static enum exit_code verb_help(struct cli *cli, int argc, char **argv);

static const struct verb verbs[] = {
	{ "status", "", "Bus, cycle, slaves and recorder on one screen.",
	  "After ecdaqd has ended it shows the last known state, marked as such.\n", verb_status },
	{ "top", "", "The same, live. Ends with q, Ctrl-C, or when ecdaqd ends.",
	  "Where standard output is not a terminal it prints one line per interval.\n", verb_top },
	{ "slaves", "[SLAVE...]", "The slaves: position, alias, AL state, name, device.", NULL,
	  verb_slaves },
	{ "topology", "[SLAVE...]", "The tree of ports, with states and delays.",
	  "at: position and port of the slave before it. cable: propagation delay, one way. "
	  "clock:\n"
	  "delay behind the reference clock. With SLAVE: it, and what is behind it.\n"
	  "ecdaq topology --dot | dot -Tsvg > bus.svg\n",
	  verb_topology },
	{ "channels", "", "The channel table: what the process image contains.", NULL,
	  verb_channels },
	{ "data", "[SLAVE...]", "The process image as bytes, as the newest cycle had it.",
	  "ecdaq data --inputs --output inputs.bin\n\n"
	  "Of a SLAVE: the bytes that its channels cover.\n",
	  verb_data },
	{ "cstruct", "", "The process image as a C header, for gcc and clang.",
	  "ecdaq cstruct --output image.h\n", verb_cstruct },
	{ "watch", "CHANNEL...", "Values of channels in every cycle.",
	  "CHANNEL may contain * and ?: 'piccolo*.adc'. A value that is not good is marked !.\n",
	  verb_watch },
	{ "set", "OUTPUT=VALUE...", "Set outputs, all in the same cycle; prints its number.",
	  "VALUE is physical, in the channel's unit; on, off, true, false for BOOL.\n", verb_set },
	{ "oneshot", "SLAVE|all", "Fire SYNC0 once at a DC time, in one-shot mode.",
	  "SLAVE is a name or a position. With all, every slave that has an output oneshot_time "
	  "is\n"
	  "armed for the same instant.\n",
	  verb_oneshot },
	{ "state", "[STATE [SLAVE...|all]]", "AL states: show them, or lead slaves to one.",
	  "ecdaq state                  the bus, its target, each slave\n"
	  "ecdaq state --wait 10s       the same, when the bus has reached its target\n"
	  "ecdaq state PREOP            the whole bus, which stays there\n"
	  "ecdaq state BOOT piccolo1    one slave, while the bus is not in operation\n\n"
	  "STATE is INIT, PREOP, BOOT (of single slaves), SAFEOP or OP.\n",
	  verb_state },
	{ "rescan", "", "Take the bus down and bring it up again, with what is there now.",
	  "Ends when the target is reached, or with the reason why not.\n", verb_rescan },
	{ "sdo", "read|write|list|startup SLAVE [INDEX:SUB] [VALUE]",
	  "Read, write or list the objects of a slave (CoE).",
	  "ecdaq sdo read piccolo0 0x1018:1 --type UDINT\n"
	  "ecdaq sdo write 0 0x8000:2 20 --type UINT\n"
	  "ecdaq sdo read 0 0x1c12 --complete          all subindices, as bytes\n"
	  "ecdaq sdo write 0 0x1c12 '01 00 00 16' --complete\n"
	  "ecdaq sdo list 0                            the object dictionary\n"
	  "ecdaq sdo list 0 0x1018                     one object of it\n"
	  "ecdaq sdo startup 0                         what ecdaqd writes on the way to OP\n\n"
	  "INDEX and SUB are hexadecimal; :SUB may be left out for 0. Types: BOOL SINT INT DINT "
	  "LINT\n"
	  "USINT UINT UDINT ULINT REAL LREAL, and for reading STRING.\n",
	  verb_sdo },
	{ "pdo", "[SLAVE...]", "SyncManagers and PDOs: assigned ones, and those that could be.",
	  "By CoE where the slave has it and its mailbox works, else by the SII.\n", verb_pdo },
	{ "soe", "read|write|list SLAVE [IDN] [VALUE]",
	  "Read, write or list the parameters of a drive (SoE).",
	  "ecdaq soe list drive0                  all IDNs (of S-0-0017)\n"
	  "ecdaq soe read drive0 S-0-0001         name, attribute, unit, limits, value\n"
	  "ecdaq soe write drive0 S-0-0001 2000 --drive 1\n\n"
	  "IDN is S-0-0001, P-0-0001, or a number. VALUE is as the attribute says; numbers of a "
	  "list\n"
	  "have commas between.\n",
	  verb_soe },
	{ "eoe", "ip SLAVE", "Show or set the IP parameters of a slave (EoE).",
	  "ecdaq eoe ip gateway0\n"
	  "ecdaq eoe ip gateway0 --ip 192.168.5.2 --mask 255.255.255.0\n\n"
	  "Not every slave reports its parameters.\n",
	  verb_eoe },
	{ "aoe", "read|write SLAVE INDEX:SUB [VALUE]",
	  "Read or write an object of a slave by ADS (AoE).",
	  "ecdaq aoe read 0 0x1018:1 --port 1000\n\n"
	  "INDEX:SUB and types as of ecdaq sdo.\n",
	  verb_aoe },
	{ "voe", "SLAVE BYTES", "One exchange of a vendor's own protocol (VoE), in hex.",
	  "ecdaq voe 0 '01 02 ff' --type 3\n", verb_voe },
	{ "reg", "read|write|watch|list SLAVE REGISTER [LENGTH|VALUE...]",
	  "Read, write or watch registers of a slave's ESC.",
	  "ecdaq reg read piccolo0 al_status      by name, with its fields\n"
	  "ecdaq reg read piccolo0 0x0130         2 bytes: AL status\n"
	  "ecdaq reg read 0 0x0300 20             20 bytes\n"
	  "ecdaq reg watch 0 dl_status            a line for each change\n"
	  "ecdaq reg list                         registers that have names\n"
	  "ecdaq reg write 0 0x0f80 1 2 0xff      3 bytes\n"
	  "ecdaq reg write 0 0x0420 1000 -t UINT  a word\n\n"
	  "While the bus is in operation, what the master needs unchanged is written with --force "
	  "only.\n",
	  verb_reg },
	{ "sii", "read|show|write|alias SLAVE [FILE|ALIAS]",
	  "Read or write a slave's EEPROM (SII).",
	  "ecdaq sii read piccolo0 --output piccolo.bin\n"
	  "ecdaq sii show piccolo0\n"
	  "ecdaq sii write piccolo0 piccolo.bin\n"
	  "ecdaq sii alias piccolo0 1001\n\n"
	  "An image is checked first and verified word by word; it is in effect after the slave's "
	  "next\n"
	  "power-on. The slave must be in INIT or PRE-OP.\n",
	  verb_sii },
	{ "foe", "read|write SLAVE NAME|FILE", "Read a file from a slave, or write one (FoE).",
	  "ecdaq foe read drive config.bin --output config.bin\n"
	  "ecdaq foe write drive config.bin --name CONFIG --password 4711\n\n"
	  "Without --name the slave gets the file under its name here, without the folders.\n",
	  verb_foe },
	{ "firmware", "SLAVE FILE", "Write a new firmware to a slave (FoE in BOOT).",
	  "ecdaq state PREOP all\n"
	  "ecdaq firmware piccolo0 firmware.bin\n\n"
	  "The slave goes to INIT and BOOT, gets the file, and goes back. After a failure, or "
	  "Ctrl-C, it\n"
	  "stays where it is, and the command may be repeated.\n",
	  verb_firmware },
	{ "scan", "", "What is on the bus, as a configuration to start from.",
	  "ecdaq scan --write ecdaq.yaml\n\n"
	  "Names, identity and alias; serial numbers, channels and PDOs as comments.\n",
	  verb_scan },
	{ "xml", "[SLAVE...]", "The slaves as an ESI file: what SII and CoE say of them.",
	  "ecdaq xml piccolo0 --output piccolo.xml\n\n"
	  "Several slaves are an EtherCATInfoList.\n",
	  verb_xml },
	{ "esi", "FILE|DIR...", "The devices that ESI files describe; errors with their lines.",
	  "ecdaq esi /etc/ecdaq/esi\n\n"
	  "Needs no ecdaqd. A folder: its files *.xml. ecdaqd uses that of bus.esi_dir.\n",
	  verb_esi },
	{ "eni", "write|check|import [FILE]",
	  "The bus as an ENI file; compare one with the bus; a configuration from one.",
	  "ecdaq eni write --output bus.xml           the plan of the running bus (ETG.2100)\n"
	  "ecdaq eni check twincat.xml                every difference between a file and the bus\n"
	  "ecdaq eni import twincat.xml -o ecdaq.yaml  a configuration; needs no ecdaqd\n\n"
	  "check: exit code 9 with a slave missing or another one, 3 with another difference; "
	  "another\n"
	  "layout of the same process data, names and addresses are allowed.\n",
	  verb_eni },
	{ "config", "show|check|diff|reload|schema [FILE]",
	  "The configuration: show, check, compare with the bus, read again.",
	  "ecdaq config show                  every option in effect, and where it is from\n"
	  "ecdaq config check ecdaq.yaml      every problem of a file\n"
	  "ecdaq config diff                  every difference between what ecdaqd was started "
	  "with\n"
	  "                                   and what is on the bus, in any state\n"
	  "ecdaq config reload                read the file again: what changed, and what of it "
	  "needs\n"
	  "                                   a rescan or a restart; a file with an error changes "
	  "nothing\n"
	  "ecdaq config schema                JSON Schema of the file, for editors\n\n"
	  "Without FILE that of --config, else of the ecdaqd that is running.\n",
	  verb_config },
	{ "crc", "[SLAVE...]", "Error counters in the registers of the slaves, port by port.",
	  "Each stops at 255. Their sums since the start of ecdaqd: ecdaq slaves -v.\n", verb_crc },
	{ "domains", "[SLAVE...]", "The cyclic frames: datagrams, FMMUs, working counters.",
	  "expected: with all slaves in OP. measured: in the newest frame that came back. Of each\n"
	  "slave its SyncManagers and active FMMUs, as they are now, and what it adds.\n",
	  verb_domains },
	{ "pcap", "", "The frames of the running bus as a capture file (pcapng).",
	  "ecdaq pcap --time 2s --output bus.pcapng\n"
	  "ecdaq pcap | wireshark -k -i -\n\n"
	  "Cyclic frames and all others, out and in; also while the bus is brought up.\n",
	  verb_pcap },
	{ "events", "", "What happened, oldest first.", NULL, verb_events },
	{ "sync0", "[calibrate]", "Results of ecdaq-sync0: the SYNC0 pulses on GPIO lines.",
	  "calibrate: the same signal is on the first two lines: measure the noise of this "
	  "board's\n"
	  "GPIO path and store it (sync0.calibration). ecdaq-sync0 must not run meanwhile.\n",
	  verb_sync0 },
	{ "histogram", "wake|round-trip|phase|work|control", "A histogram as bars.",
	  "wake: wake-up latency. round-trip: frame out to frame back. phase: magnitude of the "
	  "phase\n"
	  "error, from lock on. work: wake to end of work. control: one call of the control "
	  "program.\n",
	  verb_histogram },
	{ "metrics", "", "Figures for Prometheus.",
	  "ecdaq metrics --output /var/lib/prometheus/node-exporter/ecdaq.prom\n\n"
	  "The text format: counters, gauges and histograms of ecdaqd, its slaves and services.\n"
	  "Without ecdaqd it is \"ecdaq_up 0\".\n",
	  verb_metrics },
	{ "log", "...",
	  "Recordings: list, info, check, recover, export, cut (see ecdaq log --help).", NULL,
	  verb_program },
	{ "security", "...", "The keys of DDS Security (see ecdaq security --help).", NULL,
	  verb_program },
	{ "doctor", "", "Check this machine for the cycle; each problem with its fix.",
	  "OK, WARN: costs latency or safety. FAIL: measurements are unreliable. SKIP: does not\n"
	  "apply, or could not be read. Exit code 1 with a FAIL (--strict: or a WARN).\n",
	  verb_doctor },
	{ "clear", "", "Set counters and histograms of ecdaqd to zero.", NULL, verb_clear },
	{ "web-token", "viewer|operator|engineer", "A one-time token for a log-in on the page.",
	  "Good for one log-in within 10 minutes; printed here and nowhere else. Given by "
	  "ecdaq-web-command\n"
	  "to who may command. viewer looks, operator also sets outputs, engineer also leads "
	  "slaves and\n"
	  "the bus to states.\n",
	  verb_web_token },
	{ "stop", "", "Stop the bus and ecdaqd in order.", NULL, verb_stop },
	{ "completion", "", "Completion of this command line, for bash.",
	  "source <(ecdaq completion)\n\n"
	  "It is installed, for the package bash-completion.\n",
	  verb_completion },
	{ "manual", "[VERB]", "The manual page of ecdaq, or of a verb, for man.",
	  "ecdaq manual sdo | man -l -\n\n"
	  "They are installed: man ecdaq, man ecdaq-sdo.\n",
	  verb_manual },
	{ "help", "[VERB]", "How ecdaq, or a verb, is called.", NULL, verb_help },
	{ "version", "", "The version of this program.", NULL, verb_version },
};

enum { VERB_COUNT = sizeof(verbs) / sizeof(verbs[0]) };

static void help(void)
{
	puts("usage: ecdaq [--run-dir DIR] [--config FILE] VERB [OPTION...] [WORD...]\n");
	for (size_t i = 0; i < VERB_COUNT; i++) {
		printf("  %-10s %s\n", verbs[i].name, verbs[i].summary);
	}
	puts("\n"
	     "  --run-dir DIR   run directory of ecdaqd: rings, status page, socket (default: "
	     "runtime.run_dir\n"
	     "                  of --config, else $ECDAQ_RUN_DIR, else that of the one ecdaqd that "
	     "is\n"
	     "                  running: /run/ecdaq, /dev/shm/ecdaq-*)\n"
	     "  --config FILE   the ecdaq.yaml of that ecdaqd\n"
	     "  --help          print this text; after a verb: its options\n"
	     "  --version       print the version\n"
	     "\n"
	     "Every verb that reads has --json: one JSON value per line.\n");
	exit_code_help(stdout, CLI_EXIT_CODES);
}

static const struct verb *find_verb(const char *name)
{
	for (size_t i = 0; i < VERB_COUNT; i++) {
		if (strcmp(verbs[i].name, name) == 0) {
			return &verbs[i];
		}
	}
	return NULL;
}

/* What was written must have arrived: a full disk is a failure. A write that Ctrl-C interrupted is
 * none. */
static enum exit_code finish(const struct cli *cli, enum exit_code result)
{
	int is_lost = fflush(stdout) != 0 || ferror(stdout);

	if (is_lost && !screen_is_over() && result == EXIT_CODE_OK) {
		return cli_fail(cli, EXIT_CODE_FAILED, "standard output: %s", strerror(errno));
	}
	return result;
}

/* Once, or for each selected slave where the verb takes one; the first failure ends it. */
static enum exit_code run(struct cli *cli, int argc, char **argv)
{
	char **words = calloc((size_t)argc + 1, sizeof(*words));
	enum exit_code result;

	if (words == NULL) {
		return cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	do {
		memcpy(words, argv, (size_t)argc * sizeof(*words)); /* a run reorders them */
		result = cli->verb->run(cli, argc, words);
	} while (result == EXIT_CODE_OK && selection_has_more(cli->selection));
	selection_done(cli->selection);
	free(words);
	return result;
}

static enum exit_code verb_help(struct cli *cli, int argc, char **argv)
{
	char option[] = "--help";
	char *words[] = { option, NULL };
	struct args args = { .operands_max = 1 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (args.operand_count == 0) {
		help();
		return EXIT_CODE_OK;
	}
	cli->verb = find_verb(args.operands[0]);
	return cli->verb != NULL
		       ? run(cli, 1, words)
		       : cli_fail(cli, EXIT_CODE_USAGE, "%s: unknown command (see ecdaq --help)",
				  args.operands[0]);
}

int main(int argc, char **argv)
{
	static struct selection selection;
	struct cli cli = { .selection = &selection,
			   .select = selection_apply,
			   .verbs = verbs,
			   .verb_count = VERB_COUNT };
	struct args args = { .operands_min = 1, .operands_usage = "command", .ends_at_operand = 1 };
	char error[ARGS_ERROR_BYTES];

	switch (cli_take(&cli, &args, argc - 1, argv + 1, error)) {
	case ARGS_OK:
		break;
	case ARGS_HELP:
		help();
		return (int)finish(&cli, EXIT_CODE_OK);
	case ARGS_VERSION:
		puts("ecdaq " ECDAQ_VERSION);
		return (int)finish(&cli, EXIT_CODE_OK);
	case ARGS_ERROR:
		return (int)cli_fail(&cli, EXIT_CODE_USAGE, "%s (see ecdaq --help)", error);
	}
	cli.verb = find_verb(args.operands[0]);
	if (cli.verb == NULL) {
		return (int)cli_fail(&cli, EXIT_CODE_USAGE,
				     "%s: unknown command (see ecdaq --help)", args.operands[0]);
	}
	return (int)finish(&cli, run(&cli, args.operand_count - 1, args.operands + 1));
}
