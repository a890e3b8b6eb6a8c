/* SPDX-License-Identifier: MIT */
#include "config/config.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

/* The run directory that is named, or NULL. */
static const char *named_run_dir(const struct config *cfg)
{
	const char *env = getenv("ECDAQ_RUN_DIR");

	if (cfg != NULL && cfg->run_dir[0] != '\0') {
		return cfg->run_dir;
	}
	return env != NULL && env[0] != '\0' ? env : NULL;
}

int config_has_run_dir(const struct config *cfg)
{
	return named_run_dir(cfg) != NULL;
}

int config_run_path(const struct config *cfg, const char *file, char *ret_path, size_t path_bytes)
{
	const char *named = named_run_dir(cfg);
	char path[2 * CONFIG_PATH_BYTES];
	int len;

	if (named != NULL) {
		len = snprintf(path, sizeof(path), "%s/%s", named, file);
	} else if (geteuid() == 0) {
		len = snprintf(path, sizeof(path), "/run/ecdaq/%s", file);
	} else {
		len = snprintf(path, sizeof(path), "/dev/shm/ecdaq-%u/%s", (unsigned)geteuid(),
			       file);
	}
	if (len < 0 || (size_t)len >= sizeof(path) || (size_t)len >= path_bytes) {
		return -ENAMETOOLONG;
	}
	memcpy(ret_path, path, (size_t)len + 1);
	return 0;
}
