/* SPDX-License-Identifier: MIT */
/*
 * Preloaded into ecdaqd: while the first byte of $ECDAQ_BENCH_SWITCH is not 0, the cycle thread,
 * which has no free run of its own, does not sleep.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static const volatile char *is_on;

__attribute__((constructor)) static void map_switch(void)
{
	const char *path = getenv("ECDAQ_BENCH_SWITCH");
	int fd = path == NULL ? -1 : open(path, O_RDONLY | O_CLOEXEC);

	if (fd >= 0) {
		void *map = mmap(NULL, 1, PROT_READ, MAP_SHARED, fd, 0);

		is_on = map == MAP_FAILED ? NULL : map;
		close(fd);
	}
}

/* Asked once by each thread. */
static int is_cycle_thread(void)
{
	static _Thread_local int answer = -1;

	if (answer < 0) {
		char name[16] = "";

		prctl(PR_GET_NAME, name);
		answer = strcmp(name, "ecdaqd-cycle") == 0;
	}
	return answer;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *request,
		    struct timespec *remain)
{
	if (is_on != NULL && *is_on != 0 && is_cycle_thread()) {
		return 0;
	}
	return syscall(SYS_clock_nanosleep, clock, flags, request, remain) == 0 ? 0 : errno;
}
