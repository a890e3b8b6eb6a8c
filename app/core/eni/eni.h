/* SPDX-License-Identifier: MIT */
/*
 * EtherCAT Network Information (ENI, ETG.2100): one XML file with all that a configuration tool has
 * planned for a bus: slaves, the commands of each state change, cyclic frames, process image.
 *
 * A structure that is an element begins with @has: a bit for each field of its table (fields.c)
 * that the file has, and ENI_IS_THERE for the element itself. Numbers with the top bit set may be
 * written negative (xs:int of the schema). Texts are UTF-8, cut to their field. Names of elements:
 * ETG.2100, as KickCAT (lib/src/ENI) and the files of TwinCAT and EC-Engineer have them. Context:
 * blocking.
 */
#ifndef ENI_ENI_H
#define ENI_ENI_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum eni_limits {
	ENI_NAME_BYTES = 128,
	ENI_WORD_BYTES = 16,
	ENI_LIMIT_SM = 16,
	ENI_LIMIT_SM_PDOS = 128,
	ENI_LIMIT_EXCLUDES = 32,
	ENI_LIMIT_RANGES = 8, /* <Send>, and <Recv>, of a slave */
	ENI_LIMIT_PORTS = 4,  /* <PreviousPort> of a slave */
	ENI_LIMIT_OCTETS = 4000,
	ENI_LIMIT_SLAVES = 4096,
	ENI_LIMIT_PDOS = 16384, /* these: of a file */
	ENI_LIMIT_ENTRIES = 65536,
	ENI_LIMIT_COMMANDS = 65536,
	ENI_LIMIT_VARIABLES = 65536,
	ENI_LIMIT_FRAMES = 4096,
	ENI_LIMIT_NOTES = 1000,
};

#define ENI_IS_THERE (UINT32_C(1) << 31)
/* In place of the index of a slave: a command of the master. */
#define ENI_MASTER UINT32_MAX

/* Bits of a transition, in the order of the table of words. */
enum eni_transition {
	ENI_FROM_II,
	ENI_FROM_IP,
	ENI_FROM_PS,
	ENI_FROM_SO,
	ENI_FROM_OS,
	ENI_FROM_SP,
	ENI_FROM_PI,
	ENI_FROM_SI,
	ENI_FROM_OI,
	ENI_FROM_OP,
	ENI_FROM_IB,
	ENI_FROM_BI,
	ENI_FROM_PP,
	ENI_FROM_SS,
	ENI_FROM_OO,
	ENI_FROM_BB
};

enum eni_state { ENI_INIT = 1, ENI_PREOP = 2, ENI_SAFEOP = 4, ENI_OP = 8 };

struct eni_octets {
	uint8_t *data;
	size_t len;
};

struct eni_master {
	uint32_t has;
	char name[ENI_NAME_BYTES];
	char destination[ENI_WORD_BYTES]; /* MAC address: 12 digits */
	char source[ENI_WORD_BYTES];
	char ether_type[ENI_WORD_BYTES];
};

/* Mailbox states of all slaves in the cyclic frame. */
struct eni_mailbox_states {
	uint32_t has;
	uint32_t start;
	uint32_t count;
};

struct eni_info {
	uint32_t has;
	char name[ENI_NAME_BYTES];
	uint32_t phys_addr;
	uint32_t auto_inc_addr;
	char physics[ENI_WORD_BYTES];
	uint32_t vendor;
	uint32_t product;
	uint32_t revision;
	uint32_t serial;
};

/* <Identification Value="..."><Ado>: 0x0012 alias, 0x0134 device identification. */
struct eni_identification {
	uint32_t has;
	uint32_t value;
	uint32_t ado;
};

/* Bits of the process image. */
struct eni_range {
	uint32_t has;
	uint32_t start;
	uint32_t len;
};

struct eni_list {
	uint16_t item[ENI_LIMIT_SM_PDOS];
	size_t count;
};

struct eni_sm {
	uint32_t has;
	char type[ENI_WORD_BYTES]; /* Outputs, Inputs, MBoxOut, MBoxIn */
	uint32_t min;
	uint32_t max;
	uint32_t bytes; /* by default */
	uint32_t start;
	uint32_t control;
	uint32_t enable;
	struct eni_list pdo;
};

struct eni_area {
	uint32_t has;
	uint32_t start;
	uint32_t len;
	uint32_t poll_time_ms;
	uint32_t status_bit; /* logical, in bits */
};

struct eni_mailbox {
	uint32_t has;
	uint32_t protocols; /* bit by enum eni_protocol */
	struct eni_area send;
	struct eni_area recv;
	struct eni_area boot_send;
	struct eni_area boot_recv;
};

enum eni_protocol { ENI_AOE, ENI_EOE, ENI_COE, ENI_FOE, ENI_SOE, ENI_VOE };

struct eni_port {
	uint32_t has;
	uint32_t is_selected;
	char port[ENI_WORD_BYTES]; /* A to D */
	uint32_t phys_addr;
};

struct eni_dc {
	uint32_t has;
	uint32_t is_potential;
	uint32_t is_reference;
	int32_t cycle0_ns;
	int32_t cycle1_ns; /* register 0x09A4: SYNC1 after SYNC0 */
	int32_t shift_ns;
};

struct eni_slave {
	uint32_t has;
	int line;
	struct eni_info info;
	struct eni_identification identification;
	struct eni_range send[ENI_LIMIT_RANGES]; /* outputs */
	size_t send_count;
	struct eni_range recv[ENI_LIMIT_RANGES];
	size_t recv_count;
	struct eni_sm sm[ENI_LIMIT_SM];
	struct eni_mailbox mailbox;
	struct eni_port port[ENI_LIMIT_PORTS];
	size_t port_count;
	struct eni_dc dc;
};

struct eni_pdo {
	uint32_t has;
	uint32_t slave;
	uint32_t is_tx; /* inputs */
	uint32_t is_fixed;
	uint32_t is_mandatory;
	uint32_t sm; /* with ENI_PDO_SM */
	uint32_t index;
	char name[ENI_NAME_BYTES];
	struct eni_list exclude;
	size_t first; /* of its entries */
	size_t count;
};

struct eni_entry {
	uint32_t has;
	uint32_t index; /* 0: padding */
	uint32_t subindex;
	uint32_t bits;
	char name[ENI_NAME_BYTES];
	char comment[ENI_NAME_BYTES];
	char type[ENI_NAME_BYTES];
};

struct eni_validate {
	uint32_t has;
	struct eni_octets data;
	struct eni_octets mask;
	uint32_t timeout_ms;
};

/* A datagram: <InitCmd> of the master or of a slave, or <Cmd> of a cyclic frame. */
struct eni_command {
	uint32_t has;
	uint32_t owner; /* slave or ENI_MASTER; of a <Cmd> its frame, of all in the file */
	int line;
	uint32_t transitions; /* bit by enum eni_transition */
	uint32_t states;      /* enum eni_state */
	uint32_t is_before_slave;
	char comment[ENI_NAME_BYTES];
	char
		requires[
			ENI_WORD_BYTES];
	uint32_t cmd;
	uint32_t adp;
	uint32_t ado;
	uint32_t addr; /* logical */
	struct eni_octets data;
	uint32_t data_len;
	uint32_t cnt; /* expected working counter */
	uint32_t retries;
	struct eni_validate validate;
	uint32_t timeout_ms;
	uint32_t input_offs;
	uint32_t output_offs;
};

/* <Mailbox><CoE><InitCmds><InitCmd> */
struct eni_coe {
	uint32_t has;
	uint32_t slave;
	int line;
	uint32_t is_fixed;
	uint32_t is_complete;
	uint32_t transitions;
	char comment[ENI_NAME_BYTES];
	uint32_t timeout_ms;
	uint32_t ccs; /* 1: download; ETG.1000.6 */
	uint32_t index;
	uint32_t subindex;
	struct eni_octets data;
	uint32_t is_disabled;
};

struct eni_cyclic {
	uint32_t has;
	char comment[ENI_NAME_BYTES];
	uint32_t cycle_us;
	uint32_t priority;
	char task[ENI_NAME_BYTES];
};

struct eni_frame {
	uint32_t has;
	uint32_t cyclic;
	char comment[ENI_NAME_BYTES];
};

struct eni_variable {
	uint32_t has;
	uint32_t is_output;
	int line;
	char name[ENI_NAME_BYTES];
	char comment[ENI_NAME_BYTES];
	char type[ENI_NAME_BYTES];
	uint32_t bits;
	uint32_t offset; /* bits, in the inputs or the outputs */
};

struct eni_image {
	uint32_t has;
	uint32_t bytes;
};

/* What the file has and this structure has not. */
struct eni_note {
	int line;
	uint32_t slave; /* or ENI_MASTER */
	char what[ENI_NAME_BYTES];
};

/* Lists are in the order of the file. */
struct eni {
	struct eni_master master;
	struct eni_mailbox_states mailbox_states;
	struct eni_slave *slave;
	size_t slave_count;
	struct eni_pdo *pdo;
	size_t pdo_count;
	struct eni_entry *entry;
	size_t entry_count;
	struct eni_command *init;
	size_t init_count;
	struct eni_coe *coe;
	size_t coe_count;
	struct eni_cyclic *cyclic;
	size_t cyclic_count;
	struct eni_frame *frame;
	size_t frame_count;
	struct eni_command *cmd;
	size_t cmd_count;
	struct eni_image inputs;
	struct eni_image outputs;
	struct eni_variable *variable;
	size_t variable_count;
	struct eni_note *note;
	size_t note_count;
};

/* New rows, zeroed but for ENI_IS_THERE and their owner; NULL: no memory, or a limit. */
struct eni_slave *eni_add_slave(struct eni *eni);
struct eni_pdo *eni_add_pdo(struct eni *eni, uint32_t slave);
/** Of the newest PDO. */
struct eni_entry *eni_add_entry(struct eni *eni);
struct eni_command *eni_add_init(struct eni *eni, uint32_t owner);
struct eni_coe *eni_add_coe(struct eni *eni, uint32_t slave);
struct eni_cyclic *eni_add_cyclic(struct eni *eni);
/** Of the newest <Cyclic>. */
struct eni_frame *eni_add_frame(struct eni *eni);
/** Of the newest frame. */
struct eni_command *eni_add_cmd(struct eni *eni);
struct eni_variable *eni_add_variable(struct eni *eni, uint32_t is_output);
struct eni_note *eni_add_note(struct eni *eni);

/** @data as octets. 0 or -ENOMEM. */
int eni_octets_set(struct eni_octets *octets, const void *data, size_t len);
/** NULL is fine. */
void eni_free(struct eni *eni);

/**
 * Read an ENI file. 0 with @ret_eni, freed with eni_free(); -EBADMSG, -ENOMEM, or -errno of the
 * file, with one line "FILE:LINE: ..." in @error.
 */
int eni_read_file(const char *path, struct eni **ret_eni, char *error, size_t error_bytes);
/** The same of @text; @name stands for its file. */
int eni_read(const char *name, const char *text, size_t len, struct eni **ret_eni, char *error,
	     size_t error_bytes);
/** Write it as eni_read() reads it. Errors show in ferror(@out). */
void eni_write(FILE *out, const struct eni *eni);

#endif
