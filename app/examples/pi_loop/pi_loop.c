/* SPDX-License-Identifier: MIT */
/*
 * A PI controller: one sensor, one actuator.
 *
 *	actuator = kp * error + ki * (integral of error over time), error = set - sensor
 *
 * The actuator is limited to min..max; while it is at a limit, the integral does not grow further
 * towards it (no wind-up). A cycle without a fresh sample of the sensor changes nothing.
 *
 * control.options: sensor=CHANNEL, actuator=CHANNEL (default plant.sensor, plant.actuator), set=50,
 * kp=2.5, ki=50 (per second), min=0, max=100. The gains are for ecdaq-sim's plant (gain 1, time
 * constant tau = 50 ms): ki = kp / tau takes the plant's lag out, and the closed loop has a time
 * constant of tau / kp = 20 ms.
 */
#include <ecdaq/control.h>
#include <errno.h>

struct pi_loop {
	struct ecdaq_input sensor;
	struct ecdaq_output actuator;
	double set;
	double kp;
	double ki;
	double min;
	double max;
	double integral; /* in units of the actuator */
};

static int read_numbers(const struct ecdaq_init *in, struct pi_loop *pi)
{
	const struct {
		const char *key;
		double *value;
	} numbers[] = { { "set", &pi->set },
			{ "kp", &pi->kp },
			{ "ki", &pi->ki },
			{ "min", &pi->min },
			{ "max", &pi->max } };

	for (unsigned i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
		if (ecdaq_option_number(in, numbers[i].key, numbers[i].value) == -EINVAL) {
			return -EINVAL; /* ecdaqd says which */
		}
	}
	if (!(pi->min < pi->max)) {
		ecdaq_say(in, "min must be below max");
		return -EINVAL;
	}
	if (!(pi->kp >= 0 && pi->ki >= 0)) {
		ecdaq_say(in, "kp and ki must not be below 0");
		return -EINVAL;
	}
	return 0;
}

static int pi_init(const struct ecdaq_init *in, void **ret_state)
{
	static struct pi_loop pi;
	char sensor[64] = "plant.sensor";
	char actuator[64] = "plant.actuator";
	int r;

	pi = (struct pi_loop){ .set = 50, .kp = 2.5, .ki = 50, .max = 100 };
	*ret_state = &pi;
	if (ecdaq_option_text(in, "sensor", sensor, sizeof(sensor)) == -ENAMETOOLONG ||
	    ecdaq_option_text(in, "actuator", actuator, sizeof(actuator)) == -ENAMETOOLONG) {
		return -ENAMETOOLONG;
	}
	r = read_numbers(in, &pi);
	if (r == 0) {
		r = ecdaq_find_input(in, sensor, &pi.sensor);
	}
	return r < 0 ? r : ecdaq_find_output(in, actuator, &pi.actuator);
}

static double limit(double value, double min, double max)
{
	if (value < min) {
		return min;
	}
	return value > max ? max : value;
}

static int pi_cycle(const struct ecdaq_cycle *cy, void *state)
{
	struct pi_loop *pi = state;
	double error;
	double step;
	double wanted;

	if ((cy->flags & ECDAQ_FIRST) != 0) {
		pi->integral = 0; /* of a run that is over */
	}
	if (!ecdaq_is_good(cy, pi->sensor)) {
		return ECDAQ_GO_ON;
	}
	error = pi->set - ecdaq_get(cy, pi->sensor);
	step = pi->ki * error * (double)cy->period_ns * 1e-9;
	wanted = pi->kp * error + pi->integral + step;
	if ((wanted <= pi->max || step < 0) && (wanted >= pi->min || step > 0)) {
		pi->integral += step;
	}
	ecdaq_set(cy, pi->actuator, limit(wanted, pi->min, pi->max));
	return ECDAQ_GO_ON;
}

const struct ecdaq_program ecdaq_program = {
	ECDAQ_PROGRAM_HEAD,
	.name = "pi_loop",
	.init = pi_init,
	.cycle = pi_cycle,
};
