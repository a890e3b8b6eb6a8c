/* SPDX-License-Identifier: MIT */
#include "daemon/reload.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

int reload_init(struct reload *reload, const struct config_source *source, struct config *cfg,
		struct failure *failure)
{
	char error[FAILURE_TEXT_BYTES] = "";
	int r;

	*reload = (struct reload){ .source = *source, .running = { .cfg = cfg } };
	r = config_version_read(&reload->source, &reload->running, error, sizeof(error));
	return r < 0 ? failure_set(failure, r == -ENOMEM ? EXIT_CODE_RESOURCES : EXIT_CODE_CONFIG,
				   r, "%s", error)
		     : 0;
}

static void drop(struct config_version *version)
{
	config_version_done(version);
	free(version->cfg);
	version->cfg = NULL;
}

void reload_done(struct reload *reload)
{
	drop(&reload->next);
	config_version_done(&reload->running);
}

static int is_possible(const struct reload *reload, const struct reload_check *check,
		       const struct config_version *wanted, char *error, size_t error_bytes)
{
	struct config *trial = malloc(sizeof(*trial));
	int r;

	if (trial == NULL) {
		snprintf(error, error_bytes, "out of memory");
		return -ENOMEM;
	}
	*trial = *reload->running.cfg;
	config_take_now(trial, wanted->cfg);
	r = check->is_possible(check->ctx, trial, error, error_bytes);
	free(trial);
	return r;
}

int reload_read(struct reload *reload, const struct reload_check *check,
		struct config_change **ret_change, size_t *ret_count, char *error,
		size_t error_bytes)
{
	struct config_version wanted = { .cfg = malloc(sizeof(*wanted.cfg)) };
	struct config_change *change = NULL;
	int r = wanted.cfg == NULL ? -ENOMEM : 0;

	snprintf(error, error_bytes, "out of memory");
	r = r < 0 ? r : config_version_read(&reload->source, &wanted, error, error_bytes);
	r = r < 0 ? r : config_version_compare(&reload->running, &wanted, &change, ret_count);
	r = r < 0 ? r : is_possible(reload, check, &wanted, error, error_bytes);
	r = r < 0 ? r : config_version_take_now(&reload->running, &wanted);
	if (r < 0) {
		free(change);
		drop(&wanted);
		return r;
	}
	drop(&reload->next);
	reload->next = wanted;
	*ret_change = change;
	return 0;
}

int reload_take_rescan(struct reload *reload)
{
	int is_taken = reload->next.texts != NULL &&
		       config_version_take_rescan(&reload->running, &reload->next) == 0;

	drop(&reload->next);
	return is_taken;
}
