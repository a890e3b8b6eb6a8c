/* SPDX-License-Identifier: MIT */
/* Print every sample of a channel:  samples piccolo0.adc [RUN_DIR] */
#include <ecdaq/reader.h>
#include <inttypes.h>
#include <stdio.h>

int main(int argc, char **argv)
{
	struct ecdaq_reader *reader;
	int channel = -1;
	int result;

	if (argc < 2 || ecdaq_reader_open(argv[2], ECDAQ_FROM_OLDEST, &reader) < 0) {
		fprintf(stderr, "usage: %s CHANNEL [RUN_DIR]\n", argv[0]);
		return 2;
	}
	while ((result = ecdaq_reader_next(reader, 1000)) >= 0 && result != ECDAQ_READ_ENDED) {
		const struct ecdaq_sample *sample = ecdaq_reader_sample(reader);

		if (result == ECDAQ_READ_SESSION) {
			channel = ecdaq_reader_find(reader, argv[1]);
		} else if (result == ECDAQ_READ_SAMPLE && channel >= 0) {
			uint32_t slave = ecdaq_reader_channel(reader, (uint32_t)channel)->slave;

			printf("%" PRIu64 " %" PRId64 " %.9g%s\n", sample->cycle, sample->utc_ns,
			       ecdaq_reader_value(reader, (uint32_t)channel),
			       ecdaq_reader_is_good(reader, slave) ? "" : " bad");
		}
	}
	ecdaq_reader_close(reader);
	return channel >= 0 ? 0 : 1;
}
