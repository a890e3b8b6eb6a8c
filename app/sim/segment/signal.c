/* SPDX-License-Identifier: MIT */
#include "segment/signal.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ADC_FULL_SCALE_V 3.3
#define ADC_MAX 4095.0
#define PI 3.14159265358979323846

struct signal_spec signal_default(void)
{
	return (struct signal_spec){ .frequency_hz = 1.0, .amplitude_v = 0.5, .offset_v = 1.0 };
}

double signal_volt(const struct signal_spec *signal, int64_t t_ns)
{
	/* Whole seconds apart: at t = years the fraction of a turn needs all digits. */
	int64_t whole_s = t_ns / 1000000000;
	double s = (double)whole_s;
	double ns = (double)(t_ns % 1000000000);
	double turns = fmod(s * signal->frequency_hz, 1.0) + ns * 1e-9 * signal->frequency_hz;

	return signal->offset_v + signal->amplitude_v * sin(2.0 * PI * turns + signal->phase_rad);
}

uint16_t signal_adc(const struct signal_spec *signal, int64_t t_ns)
{
	double counts = nearbyint(signal_volt(signal, t_ns) / ADC_FULL_SCALE_V * ADC_MAX);

	counts = counts > 0.0 ? counts : 0.0; /* fmax() and fmin() are calls */
	return (uint16_t)(counts < ADC_MAX ? counts : ADC_MAX);
}

/* A finite number that ends at a colon or the text's end; moves *text behind it. */
static int parse_part(const char **text, double *ret)
{
	char *end;
	double value = strtod(*text, &end);

	if (end == *text || !isfinite(value) || (*end != ':' && *end != '\0') ||
	    (*end == ':' && end[1] == '\0')) {
		return -EINVAL;
	}
	*ret = value;
	*text = *end == ':' ? end + 1 : end;
	return 0;
}

int signal_parse(const char *text, struct signal_spec *ret_signal)
{
	struct signal_spec s = signal_default();
	double phase_deg = 0;

	if (strncmp(text, "sine:", 5) != 0) {
		return -EINVAL;
	}
	text += 5;
	if (parse_part(&text, &s.frequency_hz) < 0 || parse_part(&text, &s.amplitude_v) < 0 ||
	    parse_part(&text, &s.offset_v) < 0) {
		return -EINVAL;
	}
	if ((*text != '\0' && parse_part(&text, &phase_deg) < 0) || *text != '\0' ||
	    s.frequency_hz < 0) {
		return -EINVAL;
	}
	s.phase_rad = phase_deg * PI / 180.0;
	*ret_signal = s;
	return 0;
}
