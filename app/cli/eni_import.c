/* SPDX-License-Identifier: MIT */
#include "cli/eni_import.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/clock.h"
#include "cli/text.h"
#include "eni/fields.h"
#include "eni/mapping.h"
#include "program/json.h"
#include "wire/datagram.h"
#include "wire/esc_reg.h"

enum {
	ERROR_BYTES = 512,
	OCTETS_MAX = (CONFIG_OPTIONS_BYTES - 1) / 2,
	CHANNEL_BITS_MAX = 64,
	WATCHDOG_UNIT_NS = 40, /* times 0x0400 plus 2 */
	CCS_DOWNLOAD = 1,
	SHIFT_LIMIT_NS = 10000000,
};

/* What a variable is mapped to; entry NULL: to no entry of a PDO. */
struct place {
	uint32_t slave;
	const struct eni_entry *entry;
};

struct import {
	struct cli *cli;
	const char *path;
	const struct eni *eni;
	FILE *out;
	struct place *place; /* of each variable */
	FILE *lost;          /* what is not carried over, as comments */
	size_t channels;
	size_t losses;
};

/* --- what is not carried over --- */

static void lose(struct import *im, int line, uint32_t slave, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

static void lose(struct import *im, int line, uint32_t slave, const char *format, ...)
{
	char text[256];
	char plain[sizeof(text)];
	char where[32] = "";
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof(text), format, args);
	va_end(args);
	text_plain(text, plain, sizeof(plain));
	if (slave != ENI_MASTER) {
		snprintf(where, sizeof(where), "slave %" PRIu32 ": ", slave);
	}
	fprintf(stderr, "ecdaq: eni: %s:%d: %s%s\n", im->path, line, where, plain);
	fprintf(im->lost, "#   line %d: %s%s\n", line, where, plain);
	im->losses++;
}

/* --- names --- */

/* Letters, digits, _ and -; everything else becomes one _, none at the ends. */
static void make_name(const char *text, char *ret, size_t bytes)
{
	size_t len = 0;

	for (; *text != '\0' && len + 1 < bytes; text++) {
		if (isalnum((unsigned char)*text) || *text == '-') {
			ret[len++] = *text;
		} else if (len > 0 && ret[len - 1] != '_') {
			ret[len++] = '_';
		}
	}
	while (len > 0 && ret[len - 1] == '_') {
		len--;
	}
	ret[len] = '\0';
}

static int is_name_taken(const struct eni *eni, uint32_t slave, const char *name)
{
	for (uint32_t i = 0; i < slave; i++) {
		char other[sizeof(((struct config_slave *)0)->name)];

		make_name(eni->slave[i].info.name, other, sizeof(other));
		if (strcmp(other, name) == 0) {
			return 1;
		}
	}
	return 0;
}

static void slave_name(struct import *im, uint32_t slave, char ret[32])
{
	const struct eni_slave *sl = &im->eni->slave[slave];

	make_name(sl->info.name, ret, 32);
	if (ret[0] != '\0' && is_name_taken(im->eni, slave, ret)) {
		lose(im, sl->line, slave, "name %s: another slave has it", ret);
		ret[0] = '\0';
	}
}

/* --- start-up commands --- */

static void put_sdo(struct import *im, const struct eni_coe *coe, const char *transition)
{
	char comment[CONFIG_COMMENT_BYTES];

	fprintf(im->out,
		"      - { transition: %s, index: 0x%04" PRIx32 ", subindex: %" PRIu32
		"%s, type: OCTETS, value: \"",
		transition, coe->index, coe->subindex, coe->is_complete ? ", complete: true" : "");
	for (size_t i = 0; i < coe->data.len; i++) {
		fprintf(im->out, "%02x", coe->data.data[i]);
	}
	fputc('"', im->out);
	text_plain(coe->comment, comment, sizeof(comment));
	if (comment[0] != '\0') {
		fputs(", comment: ", im->out);
		json_put_text(im->out, comment);
	}
	fputs(" }\n", im->out);
}

/* NULL: it is one that slaves[].sdo[] can have. */
static const char *why_no_sdo(const struct eni_coe *coe)
{
	if (coe->is_disabled) {
		return "it is disabled";
	}
	if (coe->ccs != CCS_DOWNLOAD) {
		return "Ccs is not 1, an SDO download (ETG.1000.6)";
	}
	if (coe->data.len == 0) {
		return "it has no data";
	}
	if (coe->data.len > OCTETS_MAX) {
		return "its data are longer than slaves[].sdo[].value can be";
	}
	return coe->index == 0 ? "it has no index" : NULL;
}

static void put_sdos(struct import *im, uint32_t slave)
{
	static const struct {
		enum eni_transition bit;
		const char *name;
	} turns[] = { { ENI_FROM_IP, "IP" },
		      { ENI_FROM_PS, "PS" },
		      { ENI_FROM_SO, "SO" },
		      { ENI_FROM_OS, "OS" } };
	const uint32_t known = ENI_HAS(ENI_FROM_IP) | ENI_HAS(ENI_FROM_PS) | ENI_HAS(ENI_FROM_SO) |
			       ENI_HAS(ENI_FROM_OS);
	int is_open = 0;

	for (size_t i = 0; i < im->eni->coe_count; i++) {
		const struct eni_coe *coe = &im->eni->coe[i];
		const char *why = why_no_sdo(coe);

		if (coe->slave != slave) {
			continue;
		}
		if (why == NULL && (coe->transitions & ~known) != 0) {
			lose(im, coe->line, slave,
			     "start-up command 0x%04" PRIx32 ":%02" PRIx32
			     ": of its transitions, those but IP, PS, SO and OS",
			     coe->index, coe->subindex);
		}
		if (why != NULL) {
			lose(im, coe->line, slave,
			     "start-up command 0x%04" PRIx32 ":%02" PRIx32 ": %s", coe->index,
			     coe->subindex, why);
			continue;
		}
		for (size_t t = 0; t < sizeof(turns) / sizeof(turns[0]); t++) {
			if ((coe->transitions & ENI_HAS(turns[t].bit)) == 0) {
				continue;
			}
			fputs(is_open ? "" : "    sdo:\n", im->out);
			is_open = 1;
			put_sdo(im, coe, turns[t].name);
		}
	}
}

/* --- channels --- */

/* How many entries of the slave's assigned PDOs are that object. */
static unsigned count_object(const struct eni *eni, uint32_t slave, const struct eni_entry *wanted)
{
	unsigned count = 0;

	for (size_t i = 0; i < eni->pdo_count; i++) {
		const struct eni_pdo *pdo = &eni->pdo[i];

		for (size_t e = 0; e < pdo->count && pdo->slave == slave; e++) {
			const struct eni_entry *entry = &eni->entry[pdo->first + e];

			count += (pdo->has & ENI_HAS(ENI_PDO_SM)) != 0 &&
				 entry->index == wanted->index &&
				 entry->subindex == wanted->subindex;
		}
	}
	return count;
}

/* "Term 2 (EL1008).Channel 1.Input" is Channel_1_Input. */
static void channel_name(const struct eni_variable *variable, char ret[LIMIT_NAME_BYTES])
{
	const char *dot = strchr(variable->name, '.');

	make_name(dot == NULL ? variable->name : dot + 1, ret, LIMIT_NAME_BYTES);
}

/* Earlier variables of the slave that get the same name. */
static int is_channel_taken(const struct import *im, size_t number, const char *name)
{
	for (size_t i = 0; i < number; i++) {
		char other[LIMIT_NAME_BYTES];

		if (im->place[i].entry != NULL && im->place[i].slave == im->place[number].slave) {
			channel_name(&im->eni->variable[i], other);
			if (strcmp(other, name) == 0) {
				return 1;
			}
		}
	}
	return 0;
}

static const char *why_no_channel(const struct import *im, size_t number, const char *name)
{
	const struct eni_variable *variable = &im->eni->variable[number];
	const struct eni_entry *entry = im->place[number].entry;
	uint32_t slave = im->place[number].slave;
	char own[32];

	make_name(im->eni->slave[slave].info.name, own, sizeof(own));
	if (variable->bits != entry->bits || entry->bits > CHANNEL_BITS_MAX) {
		return "it is not one whole entry of a PDO of at most 64 bits";
	}
	if (count_object(im->eni, slave, entry) != 1) {
		return "its object is mapped more than once";
	}
	if (name[0] == '\0') {
		return "its name has neither letters nor digits";
	}
	if (strlen(own) + 1 + strlen(name) >= LIMIT_NAME_BYTES) {
		return "its name is too long with that of the slave";
	}
	if (is_channel_taken(im, number, name)) {
		return "another variable of the slave gets the same name";
	}
	return im->channels == CONFIG_LIMIT_CHANNELS ? "CONFIG_LIMIT_CHANNELS are there" : NULL;
}

static void put_channels(struct import *im, uint32_t slave)
{
	int is_open = 0;

	for (size_t i = 0; i < im->eni->variable_count; i++) {
		const struct eni_variable *variable = &im->eni->variable[i];
		const struct eni_entry *entry = im->place[i].entry;
		char name[LIMIT_NAME_BYTES];
		const char *why;

		if (entry == NULL || im->place[i].slave != slave) {
			continue;
		}
		channel_name(variable, name);
		why = why_no_channel(im, i, name);
		if (why != NULL) {
			lose(im, variable->line, slave, "variable %s: %s", variable->name, why);
			continue;
		}
		fputs(is_open ? "" : "    channels:\n", im->out);
		is_open = 1;
		im->channels++;
		fprintf(im->out, "      - { match: \"0x%04" PRIx32 ":%02" PRIx32 "\", name: %s }\n",
			entry->index, entry->subindex, name);
	}
}

/* --- slaves --- */

static void put_clock(struct import *im, uint32_t slave, const struct eni_registers *registers)
{
	const struct eni_slave *sl = &im->eni->slave[slave];
	const struct eni_dc *dc = &sl->dc;
	unsigned at = ESC_REG_DC_CYCLIC_CONTROL;
	unsigned word = get_le16(registers->value + at);
	int64_t period_ns = im->eni->cyclic_count > 0 ? im->eni->cyclic[0].cycle_us * NS_PER_US : 0;

	if ((dc->has & ENI_IS_THERE) == 0) {
		fputs("    assign_activate: none\n", im->out);
		return;
	}
	if (registers->is_written[at] && registers->is_written[at + 1] && word != 0) {
		fprintf(im->out, "    assign_activate: 0x%04x\n", word);
	} else if (dc->cycle0_ns == 0) {
		fputs("    assign_activate: none\n", im->out);
		return;
	} else {
		lose(im, sl->line, slave, "SYNC units: no command writes 0x0980: those of the SII");
	}
	if (dc->cycle0_ns != 0 && period_ns != 0 && dc->cycle0_ns != period_ns) {
		lose(im, sl->line, slave,
		     "CycleTime0 %" PRId32 " ns: is that of the SII's mode of assign_activate",
		     dc->cycle0_ns);
	}
	if (dc->shift_ns == 0) {
		return;
	}
	if (dc->shift_ns < -SHIFT_LIMIT_NS || dc->shift_ns > SHIFT_LIMIT_NS) {
		lose(im, sl->line, slave, "ShiftTime %" PRId32 " ns: more than sync0_shift can be",
		     dc->shift_ns);
		return;
	}
	fprintf(im->out, "    sync0_shift: %" PRId32 "ns\n", dc->shift_ns);
	lose(im, sl->line, slave,
	     "ShiftTime %" PRId32 " ns is sync0_shift, to which that of the SII's mode is added",
	     dc->shift_ns);
}

static void put_identity(struct import *im, uint32_t slave)
{
	const struct eni_slave *sl = &im->eni->slave[slave];
	const struct eni_identification *id = &sl->identification;
	char name[32];
	char plain[ENI_NAME_BYTES];

	slave_name(im, slave, name);
	fprintf(im->out, "  # %" PRIu32 ": %s\n", slave,
		text_plain(sl->info.name, plain, sizeof(plain)));
	fputs("  - name: ", im->out);
	json_put_text(im->out, name);
	fprintf(im->out,
		"\n    vendor: 0x%08" PRIx32 "\n    product: 0x%08" PRIx32
		"\n    revision: 0x%08" PRIx32 "\n",
		sl->info.vendor, sl->info.product, sl->info.revision);
	if (sl->info.serial != 0) {
		fprintf(im->out, "    serial: %" PRIu32 "\n", sl->info.serial);
	}
	if ((id->has & ENI_IS_THERE) == 0 || id->value == 0) {
		return;
	}
	if (id->ado == ESC_REG_STATION_ALIAS) {
		fprintf(im->out, "    alias: 0x%04" PRIx32 "\n", id->value);
	} else if (id->ado == ESC_REG_AL_STATUS_CODE) {
		fprintf(im->out, "    identification: %" PRIu32 "\n", id->value);
	} else {
		lose(im, sl->line, slave, "Identification by register 0x%04" PRIx32, id->ado);
	}
}

static void put_slave(struct import *im, uint32_t slave)
{
	static struct eni_registers registers; /* large */

	eni_registers_of(im->eni, slave, &registers);
	put_identity(im, slave);
	put_clock(im, slave, &registers);
	put_sdos(im, slave);
	put_channels(im, slave);
}

/* --- the bus --- */

/* Of the slave's commands; -1: none writes it. */
static int64_t watchdog_ns(const struct eni *eni, uint32_t slave)
{
	static struct eni_registers registers; /* large */
	int64_t divider;

	eni_registers_of(eni, slave, &registers);
	divider = registers.is_written[ESC_REG_WATCHDOG_DIVIDER]
			  ? get_le16(registers.value + ESC_REG_WATCHDOG_DIVIDER)
			  : 2498; /* of the chip: 100 us */
	return registers.is_written[ESC_REG_WATCHDOG_TIME_PD]
		       ? (divider + 2) * WATCHDOG_UNIT_NS *
				 get_le16(registers.value + ESC_REG_WATCHDOG_TIME_PD)
		       : -1;
}

/* One for all slaves; that of the first one that has it. */
static void put_watchdog(struct import *im)
{
	int64_t common_ns = -1;

	for (uint32_t i = 0; i < im->eni->slave_count; i++) {
		int64_t ns = watchdog_ns(im->eni, i);

		if (common_ns < 0) {
			common_ns = ns;
		} else if (ns >= 0 && ns != common_ns) {
			lose(im, im->eni->slave[i].line, i,
			     "watchdog of %" PRId64 " us: bus.watchdog is one for all slaves",
			     ns / NS_PER_US);
		}
	}
	if (common_ns < 0) {
		fputs("  watchdog: 0s  # the slaves' own\n", im->out);
	} else {
		fprintf(im->out, "  watchdog: %" PRId64 "us\n", common_ns / NS_PER_US);
	}
}

static int has_clocks(const struct eni *eni)
{
	for (size_t i = 0; i < eni->slave_count; i++) {
		if ((eni->slave[i].dc.has & ENI_IS_THERE) != 0) {
			return 1;
		}
	}
	return 0;
}

static void put_head(struct import *im)
{
	const struct eni *eni = im->eni;

	fputs("# Written by ecdaq eni import: slaves, start-up commands, clocks, cycle and names "
	      "of "
	      "an ENI file.\n"
	      "# Addresses, SyncManagers, FMMUs and cyclic frames are planned by ecdaqd: ecdaq eni "
	      "check\n# compares them with the file. To be set: bus.interface.\n"
	      "bus:\n  presence: exact\n",
	      im->out);
	put_watchdog(im);
	if (eni->cyclic_count > 0 && eni->cyclic[0].cycle_us > 0) {
		fprintf(im->out, "\ncycle:\n  period: %" PRIu32 "us\n", eni->cyclic[0].cycle_us);
	}
	if (!has_clocks(eni)) {
		fputs("\ndc:\n  enable: off\n", im->out);
	}
	fputs("\nslaves:\n", im->out);
}

/* --- what has no option --- */

static void lose_commands(struct import *im)
{
	for (size_t i = 0; i < im->eni->init_count; i++) {
		const struct eni_command *init = &im->eni->init[i];

		if (!eni_is_write(init) && init->cmd != ECAT_CMD_NOP &&
		    init->cmd != ECAT_CMD_FPRD && init->cmd != ECAT_CMD_APRD &&
		    init->cmd != ECAT_CMD_BRD) {
			lose(im, init->line, init->owner, "command %s %s",
			     ecat_cmd_to_str((uint8_t)init->cmd), init->comment);
		} else if (!eni_is_own_register(init->ado) && init->cmd != ECAT_CMD_NOP &&
			   eni_is_write(init)) {
			lose(im, init->line, init->owner, "write of register 0x%04" PRIx32 " %s",
			     init->ado, init->comment);
		}
	}
}

static void lose_others(struct import *im)
{
	const struct eni *eni = im->eni;

	for (size_t i = 0; i < eni->variable_count; i++) {
		if (im->place[i].entry == NULL) {
			lose(im, eni->variable[i].line, ENI_MASTER,
			     "variable %s: it is no entry of an assigned PDO",
			     eni->variable[i].name);
		}
	}
	for (size_t i = 1; i < eni->cyclic_count; i++) {
		lose(im, 0, ENI_MASTER, "cyclic task %zu of %" PRIu32 " us: there is one cycle",
		     i + 1, eni->cyclic[i].cycle_us);
	}
	for (size_t i = 0; i < eni->note_count; i++) {
		lose(im, eni->note[i].line, eni->note[i].slave, "%s", eni->note[i].what);
	}
	if (eni->note_count == ENI_LIMIT_NOTES) {
		lose(im, 0, ENI_MASTER, "more elements than ENI_LIMIT_NOTES");
	}
}

/* --- all --- */

static enum exit_code write_all(struct import *im)
{
	char *lost = NULL;
	size_t lost_len = 0;

	im->lost = open_memstream(&lost, &lost_len);
	if (im->lost == NULL) {
		return cli_fail(im->cli, EXIT_CODE_FAILED, "out of memory");
	}
	put_head(im);
	for (uint32_t i = 0; i < im->eni->slave_count; i++) {
		put_slave(im, i);
	}
	lose_commands(im);
	lose_others(im);
	if (fclose(im->lost) == 0 && im->losses > 0) {
		fprintf(im->out, "\n# Not carried over as it is:\n%s", lost);
	}
	free(lost);
	return EXIT_CODE_OK;
}

/* Whoever starts with the file must not be the first to see that it is wrong. */
static enum exit_code check(const struct import *im, const char *text, size_t len)
{
	struct config *cfg = malloc(sizeof(*cfg));
	char error[ERROR_BYTES] = "out of memory";
	int r = cfg == NULL
			? -ENOMEM
			: config_parse("ecdaq eni import", text, len, cfg, error, sizeof(error));

	free(cfg);
	return r == 0 ? EXIT_CODE_OK : cli_fail(im->cli, EXIT_CODE_CONFIG, "%s", error);
}

static struct place *find_places(const struct eni *eni)
{
	struct place *place = calloc(eni->variable_count + 1, sizeof(*place));

	for (size_t i = 0; place != NULL && i < eni->variable_count; i++) {
		(void)eni_variable_entry(eni, &eni->variable[i], &place[i].slave, &place[i].entry);
	}
	return place;
}

enum exit_code eni_import(struct cli *cli, const char *path, const struct eni *eni, char **ret_text,
			  size_t *ret_len)
{
	struct import im = { .cli = cli, .path = path, .eni = eni };
	enum exit_code result;

	if (eni->slave_count == 0) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: no <Slave>", path);
	}
	if (eni->slave_count > LIMIT_SLAVES || eni->variable_count > LIMIT_CHANNELS) {
		return cli_fail(cli, EXIT_CODE_FAILED, "%s: more than %s", path,
				eni->slave_count > LIMIT_SLAVES ? "LIMIT_SLAVES slaves"
								: "LIMIT_CHANNELS variables");
	}
	im.place = find_places(eni);
	im.out = open_memstream(ret_text, ret_len);
	result = im.place == NULL || im.out == NULL
			 ? cli_fail(cli, EXIT_CODE_FAILED, "out of memory")
			 : write_all(&im);
	if (im.out != NULL && fclose(im.out) != 0) {
		result = cli_fail(cli, EXIT_CODE_FAILED, "out of memory");
	}
	free(im.place);
	return result == EXIT_CODE_OK ? check(&im, *ret_text, *ret_len) : result;
}
