/* SPDX-License-Identifier: MIT */
#include "config/config.h"

#include <string.h>

#include "base/run_path.h"

/* FB1111-Piccolo: 1 converts on command. */
enum { MODE_INDEX = 0x8000, MODE_SUBINDEX = 1 };

int config_is_oneshot(const struct config *cfg, uint16_t slave_pos)
{
	if (slave_pos < cfg->slave_count && cfg->slave[slave_pos].mode != CONFIG_MODE_UNSET) {
		return cfg->slave[slave_pos].mode == CONFIG_MODE_ONESHOT;
	}
	for (size_t i = 0; i < cfg->sdo_count; i++) {
		const struct config_sdo *sdo = &cfg->sdo[i];

		if (sdo->slave_pos == slave_pos && sdo->index == MODE_INDEX &&
		    sdo->subindex == MODE_SUBINDEX && sdo->value == 1) {
			return 1;
		}
	}
	return 0;
}

static const char *run_dir(const struct config *cfg)
{
	return cfg != NULL ? cfg->run_dir : NULL;
}

int config_has_run_dir(const struct config *cfg)
{
	return run_path_named(run_dir(cfg)) != NULL;
}

int config_run_path(const struct config *cfg, const char *file, char *ret_path, size_t path_bytes)
{
	return run_path(run_dir(cfg), file, ret_path, path_bytes);
}
