/* SPDX-License-Identifier: MIT */
/* How the rows of the option table are written, and the files that hold them. Private to config/.
 */
#ifndef CONFIG_OPTION_ROWS_H
#define CONFIG_OPTION_ROWS_H

#include "config/option.h"

/* A field of struct config; in a list, of its item. */
#define FIELD(member)                                                                              \
	.offset = offsetof(struct config, member), .bytes = sizeof(((struct config *)0)->member)
#define SLAVE(member)                                                                              \
	.offset = offsetof(struct config_slave, member),                                           \
	.bytes = sizeof(((struct config_slave *)0)->member)
#define SDO(member)                                                                                \
	.offset = offsetof(struct option_sdo, member),                                             \
	.bytes = sizeof(((struct option_sdo *)0)->member)
#define PDO(member)                                                                                \
	.offset = offsetof(struct option_pdo, member),                                             \
	.bytes = sizeof(((struct option_pdo *)0)->member)
#define CHANNEL(member)                                                                            \
	.offset = offsetof(struct config_channel, member),                                         \
	.bytes = sizeof(((struct config_channel *)0)->member)
#define OUTPUT(member)                                                                             \
	.offset = offsetof(struct config_output, member),                                          \
	.bytes = sizeof(((struct config_output *)0)->member)

/* Some sections of the file, in its order. */
struct option_rows {
	const struct option *option;
	size_t count;
};

extern const struct option_rows option_rows_master;
extern const struct option_rows option_rows_services;
extern const struct option_rows option_rows_items;

#endif
