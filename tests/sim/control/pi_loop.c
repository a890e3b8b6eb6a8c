/* SPDX-License-Identifier: MIT */
/* The example "pi_loop" round the simulated plant: how fast and how exactly it settles. */
#include <math.h>

#include "devices/plant.h"
#include "harness/control_probe/probe.h"
#include "harness/test.h"
#include "sim/harness/virtual_master.h"

#define SET 50.0

static struct virtual_bench b;
static struct virtual_master vm;

static int make(int position, struct segment_slave_spec *ret_spec)
{
	return plant_slave(position, PLANT_TAU_S, PLANT_GAIN, ret_spec);
}

static const char *const settings[] = {
	"slaves[0].name=plant",
	"control.program=" ECDAQ_EXAMPLE_PROGRAMS "/pi_loop.so",
	"outputs[0].channel=plant.actuator",
	"outputs[0].owner=program",
	"outputs[0].min=0",
	"outputs[0].max=100",
	NULL,
};

static void open_all(const char *options)
{
	static const char *all[16];
	size_t n = 0;

	for (; settings[n] != NULL; n++) {
		all[n] = settings[n];
	}
	all[n] = options;
	all[options != NULL ? n + 1 : n] = NULL;
	virtual_bench_init(
		&b, &(struct virtual_spec){ .slaves = 1, .make = make, .ppm = { 30 }, .seed = 3 });
	virtual_master_init(&vm, &b, all);
	if (virtual_master_bring_up(&vm) < 0) {
		test_fail(__FILE__, __LINE__, "%s", vm.failure.text);
	}
}

static void close_all(void)
{
	virtual_master_close(&vm);
}

static double value(const char *name)
{
	uint32_t bits = (uint32_t)virtual_master_value(&vm, name);
	float f;

	memcpy(&f, &bits, sizeof(f));
	return (double)f;
}

static uint64_t started; /* cycle of the first frame with an actuator above 0 */
static uint64_t settled; /* since when the sensor has been within 2 % of the set point */
static double highest;
static double actuator_highest;

static void watch(struct virtual_master *master)
{
	uint64_t cycle;
	double sensor;

	virtual_master_run(master, 0);
	cycle = virtual_master_sample(master)->cycle;
	sensor = value("plant.sensor");
	if (started == 0 && value("plant.actuator") > 0) {
		started = cycle;
	}
	if (fabs(sensor - SET) > 0.02 * SET) {
		settled = cycle + 1;
	}
	highest = fmax(highest, sensor);
	actuator_highest = fmax(actuator_highest, value("plant.actuator"));
}

static void watch_for(uint64_t cycles)
{
	started = settled = 0;
	highest = actuator_highest = 0;
	vm.each_cycle = watch;
	virtual_master_run(&vm, cycles);
	vm.each_cycle = NULL;
}

TEST(sim_control, pi_loop_settles_within_150_ms_without_error_or_overshoot)
{
	open_all(NULL);
	watch_for(1000);
	fprintf(stderr,
		"settled to 2 %% after %llu cycles, highest %.4f, at the end %.6f, actuator "
		"%.6f, at most %.3f\n",
		(unsigned long long)(settled - started), highest, value("plant.sensor"),
		value("plant.actuator"), actuator_highest);
	CHECK(started > 0);
	CHECK(settled - started <= 150);
	CHECK(highest <= 1.001 * SET);
	CHECK(fabs(value("plant.sensor") - SET) <= 0.0001 * SET);
	CHECK(fabs(value("plant.actuator") - SET) <= 0.001 * SET); /* the plant's gain is 1 */
	CHECK(actuator_highest <= 100.0);
	CHECK_EQ(session_page(vm.session)->control.state, CONTROL_RUNNING);
	close_all();
}

static struct ecdaq_output actuator;

static int find(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	return ecdaq_find_output(in, "plant.actuator", &actuator);
}

static int give_80(const struct ecdaq_cycle *cy, void *state)
{
	(void)state;
	ecdaq_set(cy, actuator, 80);
	return ECDAQ_GO_ON;
}

TEST(sim_control, the_plant_is_a_lag_of_first_order)
{
	static const char *const with_probe[] = { "slaves[0].name=plant",
						  "control.program=" PROBE_PATH,
						  "outputs[0].channel=plant.actuator",
						  "outputs[0].owner=program", NULL };
	struct probe *probe = probe_use();

	*probe = (struct probe){ .init = find, .cycle = give_80 };
	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 1, .make = make, .seed = 3 });
	virtual_master_init(&vm, &b, with_probe);
	CHECK_EQ(virtual_master_bring_up(&vm), 0);
	virtual_master_run(&vm, 5);
	for (int i = 0; i < 100; i++) {
		double before = value("plant.sensor");
		uint64_t cycle = virtual_master_sample(&vm)->cycle;
		double periods;

		virtual_master_run(&vm, 1); /* and those that pass while the bus is looked at */
		periods = (double)(virtual_master_sample(&vm)->cycle - cycle);
		/* Each cycle brings it nearer by the factor exp(-1 ms / tau). */
		CHECK(fabs((80 - value("plant.sensor")) / (80 - before) -
			   exp(-1e-3 * periods / PLANT_TAU_S)) < 1e-4);
	}
	CHECK(value("plant.sensor") > 65 && value("plant.sensor") < 79);
	close_all();
}

TEST(sim_control, pi_loop_does_not_wind_up_at_its_limit)
{
	open_all("control.options=set=200"); /* more than the plant can reach */
	watch_for(2000);
	CHECK(fabs(value("plant.sensor") - 100.0) < 0.01);
	close_all();

	open_all("control.options=set=50, max=60");
	watch_for(1500);
	CHECK(actuator_highest <= 60.0);
	CHECK(highest <= 1.02 * SET);
	CHECK(fabs(value("plant.sensor") - SET) <= 0.0001 * SET);
	close_all();
}

TEST(sim_control, pi_loop_holds_over_lost_frames)
{
	open_all(NULL);
	watch_for(500);
	virtual_bench_fault(&b, "at=0s for=5ms lose");
	watch_for(500);
	CHECK(vm.result.lost >= 4);
	CHECK(highest <= 1.02 * SET);
	CHECK(fabs(value("plant.sensor") - SET) <= 0.001 * SET);
	close_all();
}

TEST(sim_control, the_plant_falls_to_zero_when_its_master_is_gone)
{
	int64_t start_ns;
	struct sim_device *plant;

	open_all(NULL);
	watch_for(1000);
	start_ns = virtual_bench_now_ns(&b);
	plant = segment_device(b.segment, 0);
	session_drop(vm.session);
	segment_advance(b.segment, start_ns + 50 * NS_PER_MS);
	CHECK(plant_actuator(plant) > 49);
	segment_advance(b.segment, start_ns + 103 * NS_PER_MS); /* bus.watchdog is 100 ms */
	CHECK(plant_actuator(plant) == 0.0);
	segment_advance(b.segment, start_ns + 603 * NS_PER_MS); /* ten time constants */
	CHECK(plant_sensor(plant) < 0.01);
	close_all();
}

static void check_refused(const char *options, const char *why)
{
	const char *with[] = { "slaves[0].name=plant",
			       "control.program=" ECDAQ_EXAMPLE_PROGRAMS "/pi_loop.so",
			       "outputs[0].channel=plant.actuator",
			       "outputs[0].owner=program",
			       options,
			       NULL };
	char wanted[320];

	virtual_bench_init(&b, &(struct virtual_spec){ .slaves = 1, .make = make, .seed = 3 });
	virtual_master_init(&vm, &b, with);
	CHECK(virtual_master_bring_up(&vm) < 0);
	snprintf(wanted, sizeof(wanted),
		 "control: " ECDAQ_EXAMPLE_PROGRAMS "/pi_loop.so: init() failed: %s", why);
	CHECK_STR(vm.failure.text, wanted);
	close_all();
}

TEST(sim_control, pi_loop_reports_errors_in_its_options)
{
	check_refused("control.options=min=5, max=5", "min must be below max");
	check_refused("control.options=kp=-1", "kp and ki must not be below 0");
	check_refused("control.options=ki=fast",
		      "ki: the value in control.options is not a number");
	check_refused("control.options=actuator=plant.sensor",
		      "plant.sensor: is an input and cannot be written");
}
