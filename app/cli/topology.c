/* SPDX-License-Identifier: MIT */
/* ecdaq topology: the tree of ports, as text, JSON, or for Graphviz. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "base/slave_set.h"
#include "cli/cable.h"
#include "cli/cli.h"
#include "cli/report.h"
#include "cli/source.h"
#include "cli/text.h"
#include "program/json.h"
#include "wire/al.h"

#define GET(field) atomic_load_explicit(&(field), memory_order_relaxed)

enum { INDENT_MAX = 8, LINE_BYTES = 160, DRAWN_BYTES = 2 * INDENT_MAX + 32 };

/* The order in which a frame passes the ports, behind the one it came in by. */
static const unsigned port_order[SLAVE_PORTS] = { 0, 3, 1, 2 };

struct tree {
	const struct status_page *page;
	struct slave_set shown;
	int columns; /* of the longest name with its indentation */
	/* of each slave, for the text */
	uint16_t depth[LIMIT_SLAVES];    /* branches that it is beside */
	uint8_t is_branch[LIMIT_SLAVES]; /* another branch of its parent follows */
};

static void state_of(const struct status_page *page, uint32_t pos, char *buf, size_t buf_len)
{
	if (GET(page->slave[pos].is_lost)) {
		snprintf(buf, buf_len, "LOST");
	} else {
		al_status_format(GET(page->slave[pos].al_state), buf, buf_len);
	}
}

/* Does a frame that leaves the slave by @port come to another of its branches afterwards? */
static int has_later_branch(const struct status_page *page, uint32_t pos, unsigned port)
{
	struct slave_place place = cable_place(page, pos);
	unsigned at = 0;

	while (port_order[at] != port) {
		at++;
	}
	for (unsigned i = 1; i < SLAVE_PORTS; i++) {
		unsigned next = port_order[(at + i) % SLAVE_PORTS];

		if (next == place.entry_port) {
			return 0;
		}
		if (cable_far_end(page, pos, next).kind == CABLE_END_SLAVE) {
			return 1;
		}
	}
	return 0;
}

static void measure(struct tree *tree)
{
	for (uint32_t i = 0; i < source_slave_count(tree->page); i++) {
		struct slave_place place = cable_place(tree->page, i);

		tree->depth[i] = 0;
		tree->is_branch[i] = 0;
		if (place.is_known && place.parent >= 0) {
			tree->is_branch[i] = (uint8_t)has_later_branch(
				tree->page, (uint32_t)place.parent, place.parent_port);
			tree->depth[i] = (uint16_t)(tree->depth[place.parent] + tree->is_branch[i]);
		}
	}
}

/* With all that is behind it. */
static void choose(struct tree *tree, uint32_t pos)
{
	slave_set_add(&tree->shown, pos);
	for (uint32_t i = pos + 1; i < source_slave_count(tree->page); i++) {
		struct slave_place place = cable_place(tree->page, i);

		if (place.is_known && place.parent >= 0 &&
		    slave_set_has(&tree->shown, (unsigned)place.parent)) {
			slave_set_add(&tree->shown, i);
		}
	}
}

/* --- text --- */

/* "| +-rear" */
static void draw_name(const struct tree *tree, uint32_t pos, char buf[DRAWN_BYTES])
{
	unsigned depth = tree->depth[pos] > INDENT_MAX ? INDENT_MAX : tree->depth[pos];
	size_t used = 0;

	for (unsigned i = 0; i < depth; i++) {
		int is_first = i + 1 == depth && tree->is_branch[pos];

		buf[used++] = is_first ? '+' : '|';
		buf[used++] = is_first ? '-' : ' ';
	}
	snprintf(buf + used, DRAWN_BYTES - used, "%s", source_slave(tree->page, pos).name);
}

static void write_line(const char *line)
{
	int len = (int)strlen(line);

	while (len > 0 && line[len - 1] == ' ') {
		len--;
	}
	printf("%.*s\n", len, line);
}

static void show_text(const struct tree *tree, uint32_t pos)
{
	const struct status_page *page = tree->page;
	struct slave_info info = source_slave(page, pos);
	struct slave_place place = cable_place(page, pos);
	int32_t cable_ns = GET(page->slave[pos].cable_ns);
	char drawn[DRAWN_BYTES];
	char state[24];
	char port[8] = "?";
	char from[16] = "?";
	char cable[TEXT_BYTES] = "";
	char clock[TEXT_BYTES] = "";
	char line[LINE_BYTES];

	draw_name(tree, pos, drawn);
	state_of(page, pos, state, sizeof(state));
	if (place.is_known) {
		snprintf(port, sizeof(port), "%u", place.entry_port);
		snprintf(from, sizeof(from), "%d:%u", place.parent, place.parent_port);
	}
	if (info.is_dc_reference) {
		snprintf(clock, sizeof(clock), "reference");
	} else if (info.has_dc) {
		text_ns(info.dc_delay_ns, clock);
	}
	snprintf(line, sizeof(line), "%3u %-*s %-13s %-4s %-6s %-8s %s", pos, tree->columns, drawn,
		 state, port, place.is_known && place.parent < 0 ? "master" : from,
		 cable_ns >= 0 ? text_ns(cable_ns, cable) : "", clock);
	write_line(line);
}

static void show_head(struct tree *tree)
{
	char line[LINE_BYTES];

	tree->columns = (int)strlen("slave");
	for (uint32_t i = 0; i < source_slave_count(tree->page); i++) {
		char drawn[DRAWN_BYTES];

		draw_name(tree, i, drawn);
		if (slave_set_has(&tree->shown, i) && (int)strlen(drawn) > tree->columns) {
			tree->columns = (int)strlen(drawn);
		}
	}
	snprintf(line, sizeof(line), "pos %-*s %-13s %-4s %-6s %-8s %s", tree->columns, "slave",
		 "state", "port", "at", "cable", "clock");
	write_line(line);
}

/* --- JSON --- */

static void show_counts(struct json *js, const char *key, const _Atomic uint32_t *counts)
{
	json_array_begin(js, key);
	for (unsigned port = 0; port < SLAVE_PORTS; port++) {
		json_u64(js, NULL, GET(counts[port]));
	}
	json_array_end(js);
}

static void show_place(struct json *js, const struct slave_place *place)
{
	if (!place->is_known) {
		json_null(js, "port");
		json_null(js, "open_ports");
	} else {
		json_u64(js, "port", place->entry_port);
		json_array_begin(js, "open_ports");
		for (unsigned port = 0; port < SLAVE_PORTS; port++) {
			if ((place->open_ports >> port & 1) != 0) {
				json_u64(js, NULL, port);
			}
		}
		json_array_end(js);
	}
	if (place->is_known && place->parent >= 0) {
		json_u64(js, "parent", (unsigned)place->parent);
		json_u64(js, "parent_port", place->parent_port);
	} else {
		json_null(js, "parent");
		json_null(js, "parent_port");
	}
}

static void show_json(const struct tree *tree, uint32_t pos, struct json *js)
{
	const struct slave_status *slave = &tree->page->slave[pos];
	struct slave_info info = source_slave(tree->page, pos);
	struct slave_place place = cable_place(tree->page, pos);
	char state[24];

	state_of(tree->page, pos, state, sizeof(state));
	json_object_begin(js, NULL);
	json_u64(js, "position", pos);
	json_text(js, "name", info.name);
	json_text(js, "state", state);
	show_place(js, &place);
	if (GET(slave->cable_ns) >= 0) {
		json_i64(js, "cable_ns", GET(slave->cable_ns));
	} else {
		json_null(js, "cable_ns");
	}
	if (info.has_dc) {
		json_i64(js, "clock_delay_ns", info.dc_delay_ns);
	} else {
		json_null(js, "clock_delay_ns");
	}
	json_truth(js, "dc_reference", info.is_dc_reference);
	show_counts(js, "receive_errors", slave->rx_errors);
	show_counts(js, "lost_links", slave->lost_links);
	json_object_end(js);
}

/* --- Graphviz --- */

/* @text in a label: printable ASCII without what ends it. */
static void write_label(const char *text)
{
	char plain[sizeof(((struct slave_info *)0)->device)];

	text_plain(text, plain, sizeof(plain));
	for (const char *p = plain; *p != '\0'; p++) {
		if (*p == '"' || *p == '\\') {
			putchar('\\');
		}
		putchar(*p);
	}
}

static void write_node(const struct tree *tree, uint32_t pos)
{
	uint32_t al_state = GET(tree->page->slave[pos].al_state);
	struct slave_info info = source_slave(tree->page, pos);
	int is_in_op = al_state == AL_OP && !GET(tree->page->slave[pos].is_lost);
	char state[24];

	state_of(tree->page, pos, state, sizeof(state));
	printf("  s%u [label=\"%u ", pos, pos);
	write_label(info.name);
	printf("\\n");
	write_label(info.device);
	printf("\\n%s\"%s];\n", state, is_in_op ? "" : " color=red");
}

/* Delay and errors of both ends. */
static void write_edge(const struct tree *tree, uint32_t pos)
{
	const struct slave_status *slave = tree->page->slave;
	struct slave_place place = cable_place(tree->page, pos);
	int32_t cable_ns = GET(slave[pos].cable_ns);
	uint64_t errors = GET(slave[pos].rx_errors[place.entry_port]);
	uint64_t links = GET(slave[pos].lost_links[place.entry_port]);
	char delay[TEXT_BYTES] = "";

	if (!place.is_known) {
		return;
	}
	if (place.parent < 0) {
		printf("  master -> s%u [headlabel=\"%u\"", pos, place.entry_port);
	} else {
		errors += GET(slave[place.parent].rx_errors[place.parent_port]);
		links += GET(slave[place.parent].lost_links[place.parent_port]);
		printf("  s%d -> s%u [taillabel=\"%u\" headlabel=\"%u\"", place.parent, pos,
		       place.parent_port, place.entry_port);
	}
	printf(" label=\"%s", cable_ns >= 0 ? text_ns(cable_ns, delay) : "");
	if (errors + links > 0) {
		printf("%s%" PRIu64 " errors, %" PRIu64 " lost links\" color=red",
		       cable_ns >= 0 ? "\\n" : "", errors, links);
	} else {
		putchar('"');
	}
	puts("];");
}

static void show_dot(const struct tree *tree)
{
	char interface[sizeof(tree->page->interface)];

	memcpy(interface, tree->page->interface, sizeof(interface));
	puts("digraph ecdaq {\n  rankdir=LR;\n  node [shape=box];");
	fputs("  master [shape=ellipse label=\"", stdout);
	write_label(interface);
	puts("\"];");
	for (uint32_t i = 0; i < source_slave_count(tree->page); i++) {
		if (slave_set_has(&tree->shown, i)) {
			write_node(tree, i);
		}
	}
	for (uint32_t i = 0; i < source_slave_count(tree->page); i++) {
		struct slave_place place = cable_place(tree->page, i);

		if (slave_set_has(&tree->shown, i) &&
		    (place.parent < 0 || slave_set_has(&tree->shown, (unsigned)place.parent))) {
			write_edge(tree, i);
		}
	}
	puts("}");
}

/* --- all --- */

static void show(struct tree *tree, int is_json)
{
	struct json js;

	json_init(&js, stdout);
	if (is_json) {
		json_array_begin(&js, NULL);
	} else {
		show_head(tree);
	}
	for (uint32_t i = 0; i < source_slave_count(tree->page); i++) {
		if (slave_set_has(&tree->shown, i) && is_json) {
			show_json(tree, i, &js);
		} else if (slave_set_has(&tree->shown, i)) {
			show_text(tree, i);
		}
	}
	if (is_json) {
		json_array_end(&js);
		json_end_line(&js);
	}
}

static enum exit_code choose_all(struct cli *cli, struct tree *tree, const struct args *args)
{
	if (args->operand_count == 0) {
		tree->shown = slave_set_all(source_slave_count(tree->page));
	}
	for (int i = 0; i < args->operand_count; i++) {
		uint16_t pos[LIMIT_SLAVES];
		unsigned count = 0;
		enum exit_code result =
			source_find_slaves(cli, tree->page, args->operands[i], pos, &count);

		if (result != EXIT_CODE_OK) {
			return result;
		}
		for (unsigned k = 0; k < count; k++) {
			choose(tree, pos[k]);
		}
	}
	return EXIT_CODE_OK;
}

enum exit_code verb_topology(struct cli *cli, int argc, char **argv)
{
	static struct tree tree; /* 2 KiB, and one command is run in a process */
	int is_json = 0;
	int is_dot = 0;
	const struct args_option options[] = {
		{ "dot", 0, args_flag, &is_dot, NULL,
		  "a graph for Graphviz, with delays and errors at the cables" },
		{ "json", 0, args_flag, &is_json, NULL, "a JSON array" },
	};
	struct args args = { .options = options, .option_count = 2, .operands_max = 4096 };
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	if (is_dot && is_json) {
		return cli_fail(cli, EXIT_CODE_USAGE, "--dot and --json exclude each other");
	}
	result = source_status(cli, &tree.page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	result = choose_all(cli, &tree, &args);
	if (result == EXIT_CODE_OK) {
		measure(&tree);
		if (is_dot) {
			show_dot(&tree);
		} else {
			show(&tree, is_json);
		}
	}
	source_status_close(tree.page);
	return result;
}
