/* SPDX-License-Identifier: MIT */
/* Rows of the lists of struct eni. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "eni/eni.h"
#include "xml/value.h"

/* Add a row with these fields to @list of @eni, and return it; NULL: there is no room. */
#define ADD(eni, list, limit, type, ...)                                                           \
	do {                                                                                       \
		type *grown = xml_grow(NULL, (eni)->list, &(eni)->list##_count, sizeof(*grown),    \
				       (struct xml_limit){ (limit), "" });                         \
		if (grown == NULL) {                                                               \
			return NULL;                                                               \
		}                                                                                  \
		(eni)->list = grown;                                                               \
		grown += (eni)->list##_count - 1;                                                  \
		*grown = (type){ __VA_ARGS__ };                                                    \
		return grown;                                                                      \
	} while (0)

struct eni_slave *eni_add_slave(struct eni *eni)
{
	ADD(eni, slave, ENI_LIMIT_SLAVES, struct eni_slave, .has = ENI_IS_THERE);
}

struct eni_pdo *eni_add_pdo(struct eni *eni, uint32_t slave)
{
	ADD(eni, pdo, ENI_LIMIT_PDOS, struct eni_pdo, .has = ENI_IS_THERE, .slave = slave,
	    .first = eni->entry_count);
}

static struct eni_entry *add_entry(struct eni *eni)
{
	ADD(eni, entry, ENI_LIMIT_ENTRIES, struct eni_entry, .has = ENI_IS_THERE);
}

struct eni_entry *eni_add_entry(struct eni *eni)
{
	struct eni_entry *entry = add_entry(eni);

	eni->pdo[eni->pdo_count - 1].count += entry != NULL;
	return entry;
}

struct eni_command *eni_add_init(struct eni *eni, uint32_t owner)
{
	ADD(eni, init, ENI_LIMIT_COMMANDS, struct eni_command, .has = ENI_IS_THERE, .owner = owner);
}

struct eni_coe *eni_add_coe(struct eni *eni, uint32_t slave)
{
	ADD(eni, coe, ENI_LIMIT_COMMANDS, struct eni_coe, .has = ENI_IS_THERE, .slave = slave);
}

struct eni_cyclic *eni_add_cyclic(struct eni *eni)
{
	ADD(eni, cyclic, ENI_LIMIT_FRAMES, struct eni_cyclic, .has = ENI_IS_THERE);
}

struct eni_frame *eni_add_frame(struct eni *eni)
{
	ADD(eni, frame, ENI_LIMIT_FRAMES, struct eni_frame, .has = ENI_IS_THERE,
	    .cyclic = (uint32_t)eni->cyclic_count - 1);
}

struct eni_command *eni_add_cmd(struct eni *eni)
{
	ADD(eni, cmd, ENI_LIMIT_COMMANDS, struct eni_command, .has = ENI_IS_THERE,
	    .owner = (uint32_t)eni->frame_count - 1);
}

struct eni_variable *eni_add_variable(struct eni *eni, uint32_t is_output)
{
	ADD(eni, variable, ENI_LIMIT_VARIABLES, struct eni_variable, .has = ENI_IS_THERE,
	    .is_output = is_output);
}

struct eni_note *eni_add_note(struct eni *eni)
{
	ADD(eni, note, ENI_LIMIT_NOTES, struct eni_note, .line = 0);
}

int eni_octets_set(struct eni_octets *octets, const void *data, size_t len)
{
	uint8_t *copy = malloc(len + 1);

	if (copy == NULL) {
		return -ENOMEM;
	}
	memcpy(copy, data, len);
	free(octets->data);
	*octets = (struct eni_octets){ copy, len };
	return 0;
}

void eni_free(struct eni *eni)
{
	if (eni == NULL) {
		return;
	}
	for (size_t i = 0; i < eni->init_count; i++) {
		free(eni->init[i].data.data);
		free(eni->init[i].validate.data.data);
		free(eni->init[i].validate.mask.data);
	}
	for (size_t i = 0; i < eni->cmd_count; i++) {
		free(eni->cmd[i].data.data);
	}
	for (size_t i = 0; i < eni->coe_count; i++) {
		free(eni->coe[i].data.data);
	}
	free(eni->slave);
	free(eni->pdo);
	free(eni->entry);
	free(eni->init);
	free(eni->coe);
	free(eni->cyclic);
	free(eni->frame);
	free(eni->cmd);
	free(eni->variable);
	free(eni->note);
	free(eni);
}
