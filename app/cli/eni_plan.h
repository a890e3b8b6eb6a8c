/* SPDX-License-Identifier: MIT */
/* The running bus as an ENI file has it. Failures are reported (cli_fail). Context: blocking. */
#ifndef CLI_ENI_PLAN_H
#define CLI_ENI_PLAN_H

#include "cli/cli.h"
#include "cli/mapping.h"
#include "cli/source.h"
#include "eni/eni.h"

struct eni_plan {
	struct cli *cli;
	const struct status_page *page;
	const struct config *cfg; /* of the ecdaqd that is running */
	struct samples samples;
	struct datagrams list;
	uint32_t start; /* logical address of the process image */
	struct eni *eni;
};

/** Everything that the master uses now. EXIT_CODE_OK with @ret_eni, freed with eni_free(). */
enum exit_code eni_plan_read(struct cli *cli, struct eni **ret_eni);

/* --- eni_slave.c, eni_startup.c: one slave of it --- */

struct pdo_info;

struct slave_plan {
	struct eni_plan *plan;
	uint16_t pos;
	struct slave_info info;
	struct mapping mapping;
	const struct pdo_info *pdo;
	int is_listed; /* in slaves[], as the next */
	struct config_slave item;
	int is_short; /* of memory */
};

/* A transition, as a bit. */
#define TURN(name) ENI_HAS(ENI_FROM_##name)

enum exit_code eni_plan_startup(struct slave_plan *s);

enum exit_code eni_plan_slave(struct eni_plan *plan, uint16_t pos);

#endif
