/* SPDX-License-Identifier: MIT */
#include "cli/esi_source.h"

#include <stdio.h>

#include "cli/config_file.h"
#include "cli/source.h"
#include "esi/library.h"

/* bus.esi_dir of the ecdaqd that is asked. 0; -1: it has none. */
static int find_dir(struct cli *cli, char ret_dir[CONFIG_PATH_BYTES])
{
	static struct config_file file; /* large, as the next */
	static struct config cfg;
	static const struct args_list none;
	char error[256];

	if (config_file_find(cli, NULL, &none, &file) != EXIT_CODE_OK ||
	    config_assemble(file.path, file.set.item, file.set.count, &cfg, error, sizeof(error)) <
		    0) {
		return -1;
	}
	snprintf(ret_dir, CONFIG_PATH_BYTES, "%s", cfg.bus_esi_dir);
	return ret_dir[0] == '\0' ? -1 : 0;
}

/* The descriptions of all slaves, read once; NULL: none. */
static const struct esi_library *library_of(struct cli *cli)
{
	static struct esi_library *library;
	static int is_read;
	static struct esi_identity wanted[LIMIT_SLAVES];
	char dir[CONFIG_PATH_BYTES];
	const struct status_page *page;
	uint32_t count;

	if (is_read || find_dir(cli, dir) < 0 || source_try_status(cli, &page) < 0) {
		is_read = 1;
		return library;
	}
	is_read = 1;
	count = source_slave_count(page);
	for (uint32_t i = 0; i < count; i++) {
		struct slave_info slave = source_slave(page, i);

		wanted[i] = (struct esi_identity){ .kind = ESI_DEVICE,
						   .vendor = slave.vendor,
						   .product = slave.product,
						   .revision = slave.revision };
	}
	source_status_close(page);
	library = esi_library_read(dir, wanted, count, NULL);
	return library;
}

const struct esi_device *esi_source_find(struct cli *cli, uint32_t vendor, uint32_t product,
					 uint32_t revision)
{
	return esi_library_find(library_of(cli), vendor, product, revision);
}
