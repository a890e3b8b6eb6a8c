/* SPDX-License-Identifier: MIT */
/* ecdaq status */
#include "base/args.h"
#include "cli/cli.h"
#include "cli/hints.h"
#include "cli/report.h"
#include "cli/screen.h"
#include "cli/source.h"

enum exit_code verb_status(struct cli *cli, int argc, char **argv)
{
	int is_json = 0;
	int is_summary = 0;
	const struct args_option options[] = {
		{ "json", 0, args_flag, &is_json, NULL, "one JSON object in one line" },
		{ "summary", 0, args_flag, &is_summary, NULL, "a few lines for the end of a run" },
	};
	struct args args = { .options = options, .option_count = 2 };
	const struct status_page *page;
	const struct record_status *record;
	struct report report;
	struct json js;
	enum exit_code result;

	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	result = source_status(cli, &page);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	record = source_record(cli);
	report_gather(cli, page, record, &report);
	report.is_summary = is_summary;
	if (is_json) {
		json_init(&js, stdout);
		report_write_json(&report, &js);
		json_end_line(&js);
	} else if (is_summary) {
		report_write_summary(&report, stdout);
	} else {
		report_write_screen(&report, screen_columns(), stdout);
		hints_write(report.page, screen_columns(), stdout);
	}
	report_release(&report);
	source_record_close(record);
	source_status_close(page);
	return EXIT_CODE_OK;
}
