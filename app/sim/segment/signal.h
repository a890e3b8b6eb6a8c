/* SPDX-License-Identifier: MIT */
/* What a simulated analog input sees: a pure function of time, so that a sample can be checked. */
#ifndef SIM_SEGMENT_SIGNAL_H
#define SIM_SEGMENT_SIGNAL_H

#include <stdint.h>

struct signal_spec {
	double frequency_hz;
	double amplitude_v;
	double offset_v;
	double phase_rad; /* at time 0 of the segment */
};

/** Default signal: 1 Hz, 0.5 V around 1 V. */
struct signal_spec signal_default(void);

/** Volts at true time @t_ns. */
double signal_volt(const struct signal_spec *signal, int64_t t_ns);

/** 12 bits over 0 to 3.3 V, clamped at both ends. */
uint16_t signal_adc(const struct signal_spec *signal, int64_t t_ns);

/** "sine:FREQUENCY_HZ:AMPLITUDE_V:OFFSET_V[:PHASE_DEG]". 0 or -EINVAL (ret untouched). */
int signal_parse(const char *text, struct signal_spec *ret_signal);

#endif
