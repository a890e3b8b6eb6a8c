/* SPDX-License-Identifier: MIT */
#include <inttypes.h>
#include <string.h>

#include "base/bytes.h"
#include "eni/compare.h"
#include "eni/fields.h"
#include "eni/mapping.h"
#include "wire/fmmu.h"

/* One slave of both, with its registers in OP. */
struct pair_of_slaves {
	const struct eni_compare *c;
	uint32_t number;
	const struct eni_slave *theirs;
	const struct eni_slave *ours;
	struct eni_registers their_registers;
	struct eni_registers our_registers;
};

static void differ(const struct pair_of_slaves *p, enum eni_weight weight, const char *what,
		   struct eni_pair pair, enum eni_base base)
{
	eni_differ_numbers(p->c, weight, p->number, what, pair, base);
}

/* --- SyncManagers --- */

static struct sync_manager sm_of(const struct eni_slave *slave,
				 const struct eni_registers *registers, unsigned n)
{
	unsigned at = ESC_REG_SM + n * ESC_SM_BYTES;
	uint8_t raw[ESC_SM_BYTES] = { 0 };
	const struct eni_sm *sm = &slave->sm[n];

	if (registers->is_written[at + 4] && get_le16(registers->value + at) != 0) {
		return sync_manager_parse(registers->value + at);
	}
	if ((sm->has & ENI_IS_THERE) == 0) {
		return (struct sync_manager){ 0 };
	}
	put_le16(raw, (uint16_t)sm->start);
	put_le16(raw + 2, (uint16_t)sm->bytes);
	raw[4] = (uint8_t)sm->control;
	raw[6] = (uint8_t)sm->enable;
	return sync_manager_parse(raw);
}

/* 1 if the file has nothing of the SyncManager: a mailbox is compared by its <Send> and <Recv>. */
static int is_silent(const struct pair_of_slaves *p, unsigned n)
{
	return (p->theirs->sm[n].has & ENI_IS_THERE) == 0 &&
	       get_le16(p->their_registers.value + ESC_REG_SM + (size_t)n * ESC_SM_BYTES) == 0 &&
	       (p->theirs->mailbox.send.has & ENI_IS_THERE) != 0;
}

static void compare_sm(const struct pair_of_slaves *p, unsigned n)
{
	struct sync_manager theirs = sm_of(p->theirs, &p->their_registers, n);
	struct sync_manager ours = sm_of(p->ours, &p->our_registers, n);
	const struct {
		const char *what;
		struct eni_pair pair;
		enum eni_base base;
	} rows[] = {
		{ "start", { theirs.start, ours.start }, ENI_HEX },
		{ "bytes", { theirs.bytes, ours.bytes }, ENI_DECIMAL },
		{ "written by the master", { theirs.is_write, ours.is_write }, ENI_DECIMAL },
		{ "mailbox", { theirs.is_mailbox, ours.is_mailbox }, ENI_DECIMAL },
		{ "watchdog", { theirs.has_watchdog, ours.has_watchdog }, ENI_DECIMAL },
	};
	int is_theirs = theirs.is_active && theirs.bytes > 0;
	int is_ours = ours.is_active && ours.bytes > 0;
	char what[ENI_TEXT_BYTES];

	if ((!is_theirs && !is_ours) || (is_ours && ours.is_mailbox && is_silent(p, n))) {
		return;
	}
	snprintf(what, sizeof(what), "SM%u in use", n);
	differ(p, ENI_DIFFERENT, what, (struct eni_pair){ (uint32_t)is_theirs, (uint32_t)is_ours },
	       ENI_DECIMAL);
	for (size_t i = 0; is_theirs && is_ours && i < sizeof(rows) / sizeof(rows[0]); i++) {
		snprintf(what, sizeof(what), "SM%u %s", n, rows[i].what);
		differ(p, ENI_DIFFERENT, what, rows[i].pair, rows[i].base);
	}
}

/* --- FMMUs --- */

static struct fmmu fmmu_of(const struct eni_registers *registers, unsigned n)
{
	return fmmu_parse(registers->value + ESC_REG_FMMU + (size_t)n * ESC_FMMU_BYTES);
}

static const char *describe(const struct fmmu *f, char text[ENI_TEXT_BYTES])
{
	snprintf(text, ENI_TEXT_BYTES, "0x%08" PRIx32 ".%u, %u bytes", f->logical, f->start_bit,
		 f->bytes);
	return text;
}

static int is_same_fmmu(const struct fmmu *a, const struct fmmu *b)
{
	return a->logical == b->logical && a->bytes == b->bytes && a->start_bit == b->start_bit &&
	       a->stop_bit == b->stop_bit;
}

/* Which FMMU maps the same memory in the same direction, best to the same place; FMMU_COUNT_MAX:
 * none. */
static unsigned find_fmmu(const struct eni_registers *registers, const struct fmmu *f)
{
	unsigned found = FMMU_COUNT_MAX;

	for (unsigned n = 0; n < FMMU_COUNT_MAX; n++) {
		struct fmmu other = fmmu_of(registers, n);

		if (other.is_active && other.physical == f->physical &&
		    other.physical_bit == f->physical_bit && other.is_read == f->is_read &&
		    other.is_write == f->is_write &&
		    (found == FMMU_COUNT_MAX || is_same_fmmu(&other, f))) {
			found = n;
		}
	}
	return found;
}

static unsigned bits_of(const struct fmmu *f)
{
	return f->bytes == 0 ? 0 : 8u * (f->bytes - 1u) + f->stop_bit - f->start_bit + 1u;
}

/* A mailbox state in the process image is a master's own way to look for mail. */
static enum eni_weight weight_of(const struct fmmu *f)
{
	return f->physical >= ESC_REG_SM && f->physical < ESC_REG_DC_RECEIVE_TIME_PORT
		       ? ENI_ALLOWED
		       : ENI_DIFFERENT;
}

static void compare_fmmu(const struct pair_of_slaves *p, const struct fmmu *theirs)
{
	char what[ENI_TEXT_BYTES];
	char their_text[ENI_TEXT_BYTES];
	char our_text[ENI_TEXT_BYTES];
	unsigned n = find_fmmu(&p->our_registers, theirs);
	struct fmmu ours;

	snprintf(what, sizeof(what), "FMMU of 0x%04x.%u", theirs->physical, theirs->physical_bit);
	if (n == FMMU_COUNT_MAX) {
		eni_differ(p->c, weight_of(theirs), p->number, what, describe(theirs, their_text),
			   "none");
		return;
	}
	ours = fmmu_of(&p->our_registers, n);
	if (bits_of(theirs) != bits_of(&ours)) {
		snprintf(what, sizeof(what), "bits of the FMMU of 0x%04x.%u", theirs->physical,
			 theirs->physical_bit);
		differ(p, ENI_DIFFERENT, what, (struct eni_pair){ bits_of(theirs), bits_of(&ours) },
		       ENI_DECIMAL);
	} else if (theirs->logical != ours.logical || theirs->start_bit != ours.start_bit) {
		eni_differ(p->c, ENI_ALLOWED, p->number, what, describe(theirs, their_text),
			   describe(&ours, our_text));
	}
}

static void compare_fmmus(const struct pair_of_slaves *p)
{
	char what[ENI_TEXT_BYTES];
	char text[ENI_TEXT_BYTES];

	for (unsigned n = 0; n < FMMU_COUNT_MAX; n++) {
		struct fmmu theirs = fmmu_of(&p->their_registers, n);

		if (theirs.is_active && theirs.bytes > 0) {
			compare_fmmu(p, &theirs);
		}
	}
	for (unsigned n = 0; n < FMMU_COUNT_MAX; n++) {
		struct fmmu ours = fmmu_of(&p->our_registers, n);

		if (ours.is_active && ours.bytes > 0 &&
		    find_fmmu(&p->their_registers, &ours) == FMMU_COUNT_MAX) {
			snprintf(what, sizeof(what), "FMMU of 0x%04x.%u", ours.physical,
				 ours.physical_bit);
			eni_differ(p->c, weight_of(&ours), p->number, what, "none",
				   describe(&ours, text));
		}
	}
}

/* --- PDOs --- */

/* The next PDO of the slave that is assigned to @sm, at or after @from. */
static size_t next_pdo(const struct eni *eni, uint32_t slave, unsigned sm, size_t from)
{
	while (from < eni->pdo_count && (eni->pdo[from].slave != slave || eni->pdo[from].sm != sm ||
					 (eni->pdo[from].has & ENI_HAS(ENI_PDO_SM)) == 0)) {
		from++;
	}
	return from;
}

/* What is assigned to @sm, in order: "0x1a00 0x1a01". */
static void list_pdos(const struct eni *eni, uint32_t slave, unsigned sm, char text[ENI_TEXT_BYTES])
{
	size_t len = 0;

	snprintf(text, ENI_TEXT_BYTES, "none");
	for (size_t i = next_pdo(eni, slave, sm, 0); i < eni->pdo_count && len < ENI_TEXT_BYTES;
	     i = next_pdo(eni, slave, sm, i + 1)) {
		len += (size_t)snprintf(text + len, ENI_TEXT_BYTES - len, "%s0x%04" PRIx32,
					len == 0 ? "" : " ", eni->pdo[i].index);
	}
}

static void list_entry(const struct eni_entry *entry, char text[ENI_TEXT_BYTES])
{
	snprintf(text, ENI_TEXT_BYTES, "0x%04" PRIx32 ":%02" PRIx32 ", %" PRIu32 " bits",
		 entry->index, entry->index == 0 ? 0 : entry->subindex, entry->bits);
}

static void compare_entries(const struct pair_of_slaves *p, const struct eni_pdo *theirs,
			    const struct eni_pdo *ours)
{
	size_t count = theirs->count > ours->count ? theirs->count : ours->count;
	char what[ENI_TEXT_BYTES];

	for (size_t i = 0; i < count; i++) {
		char their_text[ENI_TEXT_BYTES] = "none";
		char our_text[ENI_TEXT_BYTES] = "none";

		if (i < theirs->count) {
			list_entry(&p->c->theirs->entry[theirs->first + i], their_text);
		}
		if (i < ours->count) {
			list_entry(&p->c->ours->entry[ours->first + i], our_text);
		}
		if (strcmp(their_text, our_text) != 0) {
			snprintf(what, sizeof(what), "entry %zu of PDO 0x%04" PRIx32, i + 1,
				 theirs->index);
			eni_differ(p->c, ENI_DIFFERENT, p->number, what, their_text, our_text);
		}
	}
}

/* 1 if the PDOs of both are the same, and both have some. */
static int compare_pdos(const struct pair_of_slaves *p, unsigned sm)
{
	const struct eni *theirs = p->c->theirs;
	const struct eni *ours = p->c->ours;
	char their_list[ENI_TEXT_BYTES];
	char our_list[ENI_TEXT_BYTES];
	char what[ENI_TEXT_BYTES];
	size_t a = next_pdo(theirs, p->number, sm, 0);
	size_t b = next_pdo(ours, p->number, sm, 0);

	list_pdos(theirs, p->number, sm, their_list);
	list_pdos(ours, p->number, sm, our_list);
	if (strcmp(their_list, our_list) != 0) {
		snprintf(what, sizeof(what), "PDOs of SM%u", sm);
		eni_differ(p->c, ENI_DIFFERENT, p->number, what, their_list, our_list);
		return 0;
	}
	while (a < theirs->pdo_count && b < ours->pdo_count) {
		compare_entries(p, &theirs->pdo[a], &ours->pdo[b]);
		a = next_pdo(theirs, p->number, sm, a + 1);
		b = next_pdo(ours, p->number, sm, b + 1);
	}
	return 1;
}

/* --- mailbox and CoE --- */

static void compare_area(const struct pair_of_slaves *p, const char *name,
			 const struct eni_area *theirs, const struct eni_area *ours)
{
	char what[ENI_TEXT_BYTES];

	snprintf(what, sizeof(what), "%s mailbox start", name);
	differ(p, ENI_DIFFERENT, what, (struct eni_pair){ theirs->start, ours->start }, ENI_HEX);
	snprintf(what, sizeof(what), "%s mailbox bytes", name);
	differ(p, ENI_DIFFERENT, what, (struct eni_pair){ theirs->len, ours->len }, ENI_DECIMAL);
}

static void list_coe(const struct eni_coe *coe, char text[ENI_TEXT_BYTES])
{
	size_t len = (size_t)snprintf(text, ENI_TEXT_BYTES, "%s%s",
				      coe->is_complete ? "complete access, " : "",
				      coe->data.len == 0 ? "no data" : "");

	for (size_t i = 0; i < coe->data.len && len < ENI_TEXT_BYTES; i++) {
		len += (size_t)snprintf(text + len, ENI_TEXT_BYTES - len, "%02x",
					coe->data.data[i]);
	}
}

static int is_same_coe(const struct eni_coe *a, const struct eni_coe *b)
{
	return a->index == b->index && a->subindex == b->subindex &&
	       (a->transitions == b->transitions || (a->transitions & b->transitions) != 0) &&
	       a->is_complete == b->is_complete && a->is_disabled == b->is_disabled &&
	       a->data.len == b->data.len &&
	       (a->data.len == 0 || memcmp(a->data.data, b->data.data, a->data.len) == 0);
}

static int has_coe(const struct eni *eni, uint32_t slave, const struct eni_coe *wanted)
{
	for (size_t i = 0; i < eni->coe_count; i++) {
		if (eni->coe[i].slave == slave && is_same_coe(&eni->coe[i], wanted)) {
			return 1;
		}
	}
	return 0;
}

/* Assignment and mapping of PDOs are compared by their result. */
static int is_of_pdos(const struct eni_coe *coe)
{
	return (coe->index >= 0x1c10 && coe->index < 0x1c30) ||
	       (coe->index >= 0x1600 && coe->index < 0x1800) ||
	       (coe->index >= 0x1a00 && coe->index < 0x1c00);
}

static void compare_coe(const struct pair_of_slaves *p, int is_same_pdos)
{
	char what[ENI_TEXT_BYTES];
	char text[ENI_TEXT_BYTES];

	for (int turn = 0; turn < 2; turn++) {
		const struct eni *one = turn == 0 ? p->c->theirs : p->c->ours;
		const struct eni *other = turn == 0 ? p->c->ours : p->c->theirs;

		for (size_t i = 0; i < one->coe_count; i++) {
			const struct eni_coe *coe = &one->coe[i];

			if (coe->slave != p->number || coe->is_disabled ||
			    has_coe(other, p->number, coe)) {
				continue;
			}
			snprintf(what, sizeof(what), "start-up command 0x%04" PRIx32 ":%02" PRIx32,
				 coe->index, coe->subindex);
			list_coe(coe, text);
			eni_differ(p->c,
				   is_same_pdos && is_of_pdos(coe) ? ENI_ALLOWED : ENI_DIFFERENT,
				   p->number, what, turn == 0 ? text : "none",
				   turn == 0 ? "none" : text);
		}
	}
}

/* --- clocks and other registers --- */

static void compare_dc(const struct pair_of_slaves *p)
{
	const struct eni_dc *theirs = &p->theirs->dc;
	const struct eni_dc *ours = &p->ours->dc;

	differ(p, ENI_DIFFERENT, "reference clock",
	       (struct eni_pair){ theirs->is_reference, ours->is_reference }, ENI_DECIMAL);
	differ(p, ENI_DIFFERENT, "SYNC0 cycle in ns",
	       (struct eni_pair){ (uint32_t)theirs->cycle0_ns, (uint32_t)ours->cycle0_ns },
	       ENI_SIGN);
	differ(p, ENI_DIFFERENT, "SYNC1 cycle in ns",
	       (struct eni_pair){ (uint32_t)theirs->cycle1_ns, (uint32_t)ours->cycle1_ns },
	       ENI_SIGN);
	differ(p, ENI_DIFFERENT, "SYNC0 shift in ns",
	       (struct eni_pair){ (uint32_t)theirs->shift_ns, (uint32_t)ours->shift_ns }, ENI_SIGN);
}

static void compare_words(const struct pair_of_slaves *p)
{
	static const struct {
		uint16_t reg;
		const char *name;
	} words[] = {
		{ ESC_REG_WATCHDOG_DIVIDER, "register 0x0400 (watchdog divider)" },
		{ ESC_REG_WATCHDOG_TIME_PDI, "register 0x0410 (PDI watchdog)" },
		{ ESC_REG_WATCHDOG_TIME_PD, "register 0x0420 (process data watchdog)" },
		{ ESC_REG_DC_CYCLIC_CONTROL, "register 0x0980 (SYNC units)" },
	};

	for (size_t i = 0; i < sizeof(words) / sizeof(words[0]); i++) {
		unsigned reg = words[i].reg;

		if (p->their_registers.is_written[reg] && p->their_registers.is_written[reg + 1]) {
			differ(p, ENI_DIFFERENT, words[i].name,
			       (struct eni_pair){ get_le16(p->their_registers.value + reg),
						  get_le16(p->our_registers.value + reg) },
			       ENI_HEX);
		}
	}
}

static int has_write(const struct eni *eni, const struct eni_command *wanted)
{
	for (size_t i = 0; i < eni->init_count; i++) {
		const struct eni_command *init = &eni->init[i];

		if (init->owner == wanted->owner && init->cmd == wanted->cmd &&
		    init->ado == wanted->ado && init->data.len == wanted->data.len &&
		    (init->data.len == 0 ||
		     memcmp(init->data.data, wanted->data.data, init->data.len) == 0)) {
			return 1;
		}
	}
	return 0;
}

static void compare_others(const struct pair_of_slaves *p)
{
	for (size_t i = 0; i < p->c->theirs->init_count; i++) {
		const struct eni_command *init = &p->c->theirs->init[i];
		char what[ENI_TEXT_BYTES];

		if (init->owner == p->number && eni_is_write(init) &&
		    !eni_is_own_register(init->ado) && !has_write(p->c->ours, init)) {
			snprintf(what, sizeof(what), "write of register 0x%04" PRIx32, init->ado);
			eni_differ(p->c, ENI_ALLOWED, p->number, what, init->comment, "none");
		}
	}
}

void eni_compare_slave(const struct eni_compare *c, uint32_t slave)
{
	struct pair_of_slaves p = { .c = c,
				    .number = slave,
				    .theirs = &c->theirs->slave[slave],
				    .ours = &c->ours->slave[slave] };
	int is_same_pdos = 1;

	eni_registers_of(c->theirs, slave, &p.their_registers);
	eni_registers_of(c->ours, slave, &p.our_registers);
	compare_area(&p, "output", &p.theirs->mailbox.send, &p.ours->mailbox.send);
	compare_area(&p, "input", &p.theirs->mailbox.recv, &p.ours->mailbox.recv);
	for (unsigned n = 0; n < ENI_LIMIT_SM; n++) {
		compare_sm(&p, n);
		is_same_pdos &= compare_pdos(&p, n);
	}
	compare_fmmus(&p);
	compare_coe(&p, is_same_pdos);
	compare_dc(&p);
	compare_words(&p);
	compare_others(&p);
}
