/* SPDX-License-Identifier: MIT */
#include "sim/harness/value_oracle.h"

#include <stdio.h>

#include "devices/fb1111_piccolo.h"

static struct signal_spec signal_of(unsigned slave)
{
	return (struct signal_spec){
		.frequency_hz = 37.0, .amplitude_v = 1.5, .offset_v = 1.65, .phase_rad = slave
	};
}

int value_oracle_slave(int position, struct segment_slave_spec *ret_spec)
{
	int r = fb1111_piccolo_slave(position, ret_spec);

	ret_spec->signal = signal_of((unsigned)position);
	return r;
}

int value_oracle_check(const struct virtual_master *vm, unsigned slave, const char *name,
		       uint64_t *ret_got, uint64_t *ret_was)
{
	const struct sample_header *h = virtual_master_sample(vm);
	struct signal_spec signal = signal_of(slave);
	int64_t edge_ns;
	char channel[32];

	if (slave_set_has(&h->slaves_bad, slave)) {
		return 0;
	}
	edge_ns = virtual_bench_edge_ns(vm->bench, slave, h->dc_time_ns);
	snprintf(channel, sizeof(channel), "%s.adc", name);
	*ret_got = virtual_master_value(vm, channel);
	*ret_was = edge_ns == 0 ? 0 : signal_adc(&signal, edge_ns);
	return edge_ns != 0 && *ret_got == *ret_was ? 1 : -1;
}
