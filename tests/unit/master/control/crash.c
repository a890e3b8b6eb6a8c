/* SPDX-License-Identifier: MIT */
/* A crash inside the program comes back; one outside ends the process, as without a program. */
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench.h"

#define PLAIN __attribute__((noinline, no_sanitize("address"), no_sanitize("undefined")))

enum kind { NO_PAGE, BUS_ERROR, OVERFLOW, ABORT, DIVISION, FROM_OUTSIDE };

static struct ecdaq_output led;
static enum kind kind;
static volatile uint8_t *beyond;

static PLAIN void write_to(uintptr_t address)
{
	*(volatile uint8_t *)address = 1;
}

static PLAIN int run_over(volatile int *depth)
{
	volatile uint8_t frame[512];

	frame[0] = (uint8_t)(*depth)++;
	return *depth > 0 ? run_over(depth) + frame[0] : 0;
}

static int crash(const struct ecdaq_cycle *cy, void *state)
{
	volatile int depth = 0;

	(void)state;
	ecdaq_set(cy, led, 1);
	switch (kind) {
	case NO_PAGE:
		write_to(8);
		break;
	case BUS_ERROR:
		write_to((uintptr_t)beyond);
		break;
	case OVERFLOW:
		return run_over(&depth);
	case ABORT:
		abort();
	case DIVISION:
		raise(SIGFPE);
		break;
	case FROM_OUTSIDE:
		kill(getpid(), SIGSEGV);
		break;
	}
	return ECDAQ_GO_ON;
}

static int find_led(const struct ecdaq_init *in, void **ret_state)
{
	(void)ret_state;
	return ecdaq_find_output(in, "a.led", &led);
}

static void begin(enum kind how)
{
	struct probe *probe = bench_configure();

	probe->init = find_led;
	probe->cycle = crash;
	kind = how;
	CHECK_EQ(bench_begin(), 0);
}

static void *crash_in_thread(void *arg)
{
	sigset_t all;

	/* As the cycle's thread has it. */
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, NULL);
	control_enter(bench.control);
	*(enum control_result *)arg = bench_run();
	control_leave(bench.control);
	return NULL;
}

static void check_comes_back(enum kind how, int number)
{
	enum control_result result = CONTROL_DONE;
	struct control_crash seen = { 0 };
	pthread_t thread;
	uint64_t raw;

	begin(how);
	CHECK_EQ(control_crash(bench.control, &seen), -ENODATA);
	CHECK_EQ(pthread_create(&thread, NULL, crash_in_thread, &result), 0);
	CHECK_EQ(pthread_join(thread, NULL), 0);
	CHECK_EQ(result, CONTROL_CRASH);
	CHECK_EQ(control_crash(bench.control, &seen), 0);
	CHECK_EQ(seen.number, number);
	CHECK_EQ(seen.cycle, 101);
	CHECK_EQ(bench_output(BOARD_LED, &raw), 0);
	CHECK(control_is_safe(bench.control));
	CHECK_EQ(bench.status.state, CONTROL_CRASHED);
	CHECK_EQ(control_busy_ns(bench.control, (mono_t){ 5000 }), 0);
	CHECK_EQ(bench_run(), CONTROL_REST);
	bench_done();
}

TEST(control, a_wild_pointer_is_returned)
{
	check_comes_back(NO_PAGE, SIGSEGV);
}

TEST(control, a_bus_error_is_returned)
{
	int fd = memfd_create("ecdaq-test", MFD_CLOEXEC);

	CHECK(fd >= 0);
	beyond = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
	CHECK(beyond != MAP_FAILED);
	check_comes_back(BUS_ERROR, SIGBUS);
}

TEST(control, a_stack_overflow_is_returned)
{
	check_comes_back(OVERFLOW, SIGSEGV);
}

TEST(control, abort_and_a_failed_assertion_are_returned)
{
	check_comes_back(ABORT, SIGABRT);
}

TEST(control, an_arithmetic_error_is_returned)
{
	check_comes_back(DIVISION, SIGFPE);
}

TEST(control, a_crash_is_reported_in_one_line)
{
	char text[320];
	enum control_result result;

	begin(NO_PAGE);
	crash_in_thread(&result);
	control_describe_end(bench.control, text, sizeof(text));
	CHECK_STR(text, "control: " PROBE_PATH
			": crashed with SIGSEGV (at 0x8) in cycle 101; outputs made safe");
	bench_done();
}

static int exits;

static void count_exit(void *state)
{
	(void)state;
	exits++;
}

TEST(control, nothing_of_a_crashed_program_is_called_again)
{
	enum control_result result;
	struct probe *probe = probe_use();

	begin(NO_PAGE);
	probe->exit = count_exit;
	crash_in_thread(&result);
	control_pause(bench.control);
	CHECK_EQ(bench_run(), CONTROL_REST);
	bench_done();
	CHECK_EQ(exits, 0);
}

/* What becomes of a process that does @what after a program was loaded: its wait status. */
static int status_of(void (*what)(void))
{
	int status = 0;
	pid_t pid = fork();

	CHECK(pid >= 0);
	if (pid == 0) {
		const struct rlimit none = { 0, 0 };

		setrlimit(RLIMIT_CORE, &none);
		what();
		_exit(0);
	}
	CHECK_EQ(waitpid(pid, &status, 0), pid);
	return status;
}

static void crash_elsewhere(void)
{
	begin(NO_PAGE);
	control_enter(bench.control);
	write_to(8);
}

static void crash_by_somebody(void)
{
	begin(FROM_OUTSIDE);
	control_enter(bench.control);
	bench_run();
}

static void crash_after_its_end(void)
{
	begin(NO_PAGE);
	bench_done();
	write_to(8);
}

TEST(control, a_crash_elsewhere_ends_the_process)
{
	CHECK(status_of(crash_elsewhere) != 0);
	CHECK(status_of(crash_after_its_end) != 0);
}

TEST(control, a_signal_sent_by_a_process_ends_the_process)
{
	CHECK(status_of(crash_by_somebody) != 0);
}
