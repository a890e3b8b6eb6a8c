/* SPDX-License-Identifier: MIT */
/* From a path to a program that has found its channels, and back. */
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "config/output.h"
#include "control/control_internal.h"

#define SYMBOL "ecdaq_program"

static_assert((int)ECDAQ_LOST == (int)SAMPLE_LOST && (int)ECDAQ_LATE == (int)SAMPLE_LATE &&
		      (int)ECDAQ_WKC_LOW == (int)SAMPLE_WKC_LOW &&
		      (int)ECDAQ_FAIL_SAFE == (int)SAMPLE_FAIL_SAFE &&
		      (int)ECDAQ_BAD_COUNTER == (int)SAMPLE_BAD_COUNTER &&
		      (int)ECDAQ_DC_UNLOCKED == (int)SAMPLE_DC_UNLOCKED,
	      "flags of a sample, as a program sees them");

struct complaint {
	const struct config *cfg;
	char *error;
	size_t error_bytes;
};

static int complain(const struct complaint *to, int r, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Printable and one line, whatever the user's text contains. */
static int complain(const struct complaint *to, int r, const char *format, ...)
{
	char text[2 * CONTROL_TEXT_BYTES];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof(text), format, args);
	va_end(args);
	for (char *p = text; *p != '\0'; p++) {
		if (*p < 0x20 || *p > 0x7e) {
			*p = ' ';
		}
	}
	snprintf(to->error, to->error_bytes, "control: %s: %s", to->cfg->control_program, text);
	return r;
}

/* --- the file --- */

static int check_file(const struct complaint *to, const char *path)
{
	struct stat st;

	if (strchr(path, '/') == NULL) {
		return complain(to, -EINVAL, "expected a path with a slash (control.program)");
	}
	if (stat(path, &st) < 0) {
		int r = -errno;

		return complain(to, r, "%s", strerror(-r));
	}
	if (!S_ISREG(st.st_mode)) {
		return complain(to, -EINVAL, "is not a file");
	}
	/* It runs with the rights of ecdaqd. */
	if ((st.st_mode & S_IWOTH) != 0) {
		return complain(to, -EPERM, "world-writable, not loaded (chmod o-w)");
	}
	return 0;
}

/* The text of dlopen() begins with the path, which is in the message already. */
static const char *dl_reason(const char *path)
{
	const char *text = dlerror();
	size_t len = strlen(path);

	if (text == NULL) {
		return "cannot be loaded";
	}
	return strncmp(text, path, len) == 0 && strncmp(text + len, ": ", 2) == 0 ? text + len + 2
										  : text;
}

static int check_program(const struct complaint *to, const struct ecdaq_program *program)
{
	if (program == NULL) {
		return complain(to, -ENOEXEC, "has no symbol " SYMBOL ": no control program");
	}
	if (program->abi != ECDAQ_CONTROL_ABI) {
		return complain(to, -ENOEXEC,
				"was built for version %u of ecdaq/control.h, this ecdaqd has %u: "
				"rebuild it",
				program->abi, ECDAQ_CONTROL_ABI);
	}
	if (program->bytes != sizeof(*program)) {
		return complain(to, -ENOEXEC,
				SYMBOL ".bytes is %u instead of %zu: use ECDAQ_PROGRAM_HEAD",
				program->bytes, sizeof(*program));
	}
	if (program->init == NULL || program->cycle == NULL) {
		return complain(to, -ENOEXEC, SYMBOL " has no %s()",
				program->init == NULL ? "init" : "cycle");
	}
	return 0;
}

static int load(struct control *ctl, const struct complaint *to)
{
	const char *path = ctl->cfg->control_program;
	char reason[128];
	int r = check_file(to, path);

	if (r < 0) {
		return r;
	}
	r = arguments_parse(&ctl->arguments, ctl->cfg->control_options, reason, sizeof(reason));
	if (r < 0) {
		return complain(to, r, "control.options: %s", reason);
	}
	dlerror();
	ctl->object = dlopen(path, RTLD_NOW | RTLD_LOCAL);
	if (ctl->object == NULL) {
		return complain(to, -ENOEXEC, "%s", dl_reason(path));
	}
	ctl->program = dlsym(ctl->object, SYMBOL);
	return check_program(to, ctl->program);
}

int control_load(const struct config *cfg, struct control **ret_control, char *error,
		 size_t error_bytes)
{
	const struct complaint to = { cfg, error, error_bytes };
	struct control *ctl = aligned_alloc(64, (sizeof(*ctl) + 63) / 64 * 64);
	int r;

	if (ctl == NULL) {
		return complain(&to, -ENOMEM, "no memory");
	}
	memset(ctl, 0, sizeof(*ctl));
	ctl->cfg = cfg;
	board_init(&ctl->board);
	r = load(ctl, &to);
	if (r == 0) {
		r = guard_install();
		ctl->is_guarded = r == 0;
	}
	if (r < 0) {
		control_destroy(ctl);
		return r;
	}
	*ret_control = ctl;
	return 0;
}

/* --- init() --- */

/* The n-th output channel is the n-th place on the board; cycle_create() has counted them. */
static void place_outputs(struct control *ctl)
{
	for (size_t i = 0; i < ctl->spec.channel_count; i++) {
		const struct channel *ch = &ctl->spec.channels[i];
		const struct config_output *wanted = config_output_find(ctl->cfg, ch->name);

		ctl->output_of[i] = -1;
		if (ch->direction != CHANNEL_OUTPUT || ctl->output_count == BOARD_OUTPUTS) {
			continue;
		}
		ctl->output_of[i] = (int16_t)ctl->output_count;
		if (wanted != NULL && wanted->owner == CONFIG_OWNER_PROGRAM) {
			ctl->output[ctl->output_count].is_own = 1;
			ctl->output[ctl->output_count].min = wanted->min;
			ctl->output[ctl->output_count].max = wanted->max;
		}
		ctl->output_count++;
	}
}

static int call_init(struct control *ctl, const struct complaint *to)
{
	const struct ecdaq_init in = {
		.calls = &control_calls,
		.host = ctl,
		.period_ns = ctl->cfg->cycle_period_ns,
		.budget_ns = ctl->cfg->control_budget_ns,
		.slave_count = (uint32_t)ctl->spec.slave_count,
	};
	const char *unasked;
	int r = ctl->program->init(&in, &ctl->state);

	if (r != 0) {
		const char *reason = ctl->message[0] != '\0' ? ctl->message : ctl->first_error;

		if (reason[0] == '\0') {
			reason = r < 0 && strerrordesc_np(-r) != NULL ? strerrordesc_np(-r)
								      : "no reason given";
		}
		return complain(to, -EINVAL, "init() failed: %s", reason);
	}
	ctl->has_begun = 1;
	unasked = arguments_unused(&ctl->arguments);
	if (unasked != NULL) {
		return complain(to, -EINVAL, "control.options: %.40s: unknown key", unasked);
	}
	return 0;
}

int control_begin(struct control *control, const struct control_spec *spec, char *error,
		  size_t error_bytes)
{
	const struct complaint to = { control->cfg, error, error_bytes };
	struct control_status *st = spec->status;
	int r;

	if (spec->channel_count > LIMIT_CHANNELS) {
		return complain(&to, -E2BIG, "more than LIMIT_CHANNELS = %d channels",
				LIMIT_CHANNELS);
	}
	control->spec = *spec;
	control->state_now = CONTROL_WAITING;
	place_outputs(control);
	memset(st, 0, sizeof(*st));
	snprintf(st->name, sizeof(st->name), "%s", control_name(control));
	snprintf(st->path, sizeof(st->path), "%s", control->cfg->control_program);
	st->budget_ns = control->cfg->control_budget_ns;
	r = call_init(control, &to);
	atomic_store_explicit(&st->state, r < 0 ? CONTROL_NONE : CONTROL_WAITING,
			      memory_order_relaxed);
	return r;
}

const char *control_name(const struct control *control)
{
	return control->program->name != NULL ? control->program->name
					      : control->cfg->control_program;
}

struct board *control_board(struct control *control)
{
	return &control->board;
}

void control_destroy(struct control *control)
{
	if (control == NULL) {
		return;
	}
	/* After a crash nothing of the program's is touched any more. */
	if (control->state_now != CONTROL_CRASHED) {
		if (control->has_begun && control->state_now != CONTROL_STOPPED) {
			atomic_store_explicit(&control->spec.status->state, CONTROL_WAITING,
					      memory_order_relaxed);
		}
		if (control->has_begun && control->program->exit != NULL) {
			control->program->exit(control->state);
		}
		if (control->object != NULL) {
			dlclose(control->object);
		}
	}
	if (control->is_guarded) {
		guard_remove();
	}
	free(control);
}
