/* SPDX-License-Identifier: MIT */
#include "cli/follow.h"

#include <errno.h>
#include <stddef.h>

#include "base/clock.h"
#include "cli/screen.h"
#include "reader/page.h"

enum exit_code follow_open(struct cli *cli, struct follow *ret_follow)
{
	struct follow follow = { .cli = cli, .idle_ns = 5 * NS_PER_MS };
	enum exit_code result = samples_open(cli, &follow.samples);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	(void)source_try_status(cli, &follow.page);
	*ret_follow = follow;
	return EXIT_CODE_OK;
}

void follow_close(struct follow *follow)
{
	samples_close(&follow->samples);
	source_status_close(follow->page);
	follow->page = NULL;
}

/* The ring is closed. Is its ecdaqd still there, so that another one may follow? */
static int may_continue(struct follow *follow)
{
	const struct status_page *page;
	uint32_t state;

	if (source_try_status(follow->cli, &page) < 0) {
		return 0;
	}
	source_status_close(follow->page);
	follow->page = page;
	state = atomic_load_explicit(&page->bus_state, memory_order_relaxed);
	return page_is_alive(page->pid) && state != BUS_STOPPED && state != BUS_FAILED;
}

enum follow_result follow_next(struct follow *follow, uint64_t *ret_lost)
{
	enum follow_result result = FOLLOW_IDLE;

	follow->key = follow->is_idle ? screen_wait(follow->idle_ns) : 0;
	if (screen_is_over()) {
		return FOLLOW_OVER;
	}
	switch (reader_next(follow->samples.reader, ret_lost)) {
	case READER_SAMPLE:
		result = FOLLOW_SAMPLE;
		break;
	case READER_LOST:
		result = FOLLOW_LOST;
		break;
	case READER_EMPTY:
		break;
	case READER_BEGUN:
		samples_take_table(&follow->samples);
		result = FOLLOW_NEW_BUS;
		break;
	case READER_ENDED:
	case READER_WAITING:
		if (reader_error(follow->samples.reader) == -EIO) {
			return FOLLOW_DAMAGED;
		}
		result = may_continue(follow) ? FOLLOW_IDLE : FOLLOW_ENDED;
		break;
	}
	follow->is_idle = result == FOLLOW_IDLE;
	return result;
}
