/* SPDX-License-Identifier: MIT */
/* What the doctor reads line by line. */
#include "cli/doctor/irq.h"
#include "cli/doctor/thread.h"

#include <errno.h>

#include "harness/test.h"

/* proc(5): pid (comm) state ppid ... flags is the 9th, rt_priority the 40th, policy the 41st. */
#define STAT_MIDDLE " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 17 3"

TEST(doctor_thread, a_line_of_stat_gives_name_kind_and_policy)
{
	struct thread thread;

	CHECK_EQ(thread_parse_stat("1234 (ecdaqd-cycle) S 1 1 1 0 -1 4194368" STAT_MIDDLE
				   " 80 1 0 0\n",
				   &thread),
		 0);
	CHECK_EQ(thread.tid, 1234);
	CHECK_STR(thread.name, "ecdaqd-cycle");
	CHECK_EQ(thread.is_kernel, 0);
	CHECK_EQ(thread.policy, THREAD_FIFO);
	CHECK_EQ(thread.priority, 80);
}

TEST(doctor_thread, a_name_may_hold_brackets_and_blanks)
{
	struct thread thread;

	CHECK_EQ(thread_parse_stat("7 (a) S (b c) I 2 0 0 0 -1 2129984" STAT_MIDDLE " 0 0 0 0",
				   &thread),
		 0);
	CHECK_STR(thread.name, "a) S (b c");
	CHECK_EQ(thread.is_kernel, 1);
	CHECK_EQ(thread.policy, 0);
}

TEST(doctor_thread, a_line_that_is_cut_leaves_the_output_untouched)
{
	struct thread thread = { .tid = 77 };

	CHECK_EQ(thread_parse_stat("", &thread), -EBADMSG);
	CHECK_EQ(thread_parse_stat("12", &thread), -EBADMSG);
	CHECK_EQ(thread_parse_stat("12 (a", &thread), -EBADMSG);
	CHECK_EQ(thread_parse_stat("12 )a(", &thread), -EBADMSG);
	CHECK_EQ(thread_parse_stat("12 (a) S 1 1 1 0 -1 4194368 0 0", &thread), -EBADMSG);
	CHECK_EQ(thread_parse_stat("-1 (a) S 1 1 1 0 -1 64" STAT_MIDDLE " 0 0", &thread), -EBADMSG);
	CHECK_EQ(thread.tid, 77);
}

TEST(doctor_thread, policies_have_their_names)
{
	struct thread thread = { .policy = THREAD_FIFO, .priority = 80 };
	char buf[32];

	CHECK_STR(thread_policy(&thread, buf), "SCHED_FIFO 80");
	thread.policy = 0;
	CHECK_STR(thread_policy(&thread, buf), "SCHED_OTHER");
	thread.policy = 6;
	CHECK_STR(thread_policy(&thread, buf), "SCHED_DEADLINE");
	thread.policy = 99;
	CHECK_STR(thread_policy(&thread, buf), "policy 99");
	thread.policy = -1;
	CHECK_STR(thread_policy(&thread, buf), "policy -1");
}

TEST(doctor_irq, a_line_gives_number_count_and_user)
{
	struct irq irq;

	CHECK_EQ(irq_parse(" 40:         12          0    6100200     GICv2 189 Level     ecat0\n",
			   &irq),
		 0);
	CHECK_EQ(irq.number, 40);
	CHECK_EQ(irq.count, 6100212);
	CHECK(irq_is_of(&irq, "ecat0"));
	CHECK_EQ(irq_parse("124:  1  PCI-MSIX-0000:00:03.0   1-edge      eth0-rx-0", &irq), 0);
	CHECK_EQ(irq.count, 1);
	CHECK(irq_is_of(&irq, "eth0"));
}

TEST(doctor_irq, headings_and_the_kernel_s_own_are_none)
{
	struct irq irq = { .number = 77 };

	CHECK_EQ(irq_parse("           CPU0       CPU1       \n", &irq), -EBADMSG);
	CHECK_EQ(irq_parse("NMI:          0          0   Non-maskable interrupts\n", &irq),
		 -EBADMSG);
	CHECK_EQ(irq_parse("IPI0:        10         11       Rescheduling interrupts\n", &irq),
		 -EBADMSG);
	CHECK_EQ(irq_parse("", &irq), -EBADMSG);
	CHECK_EQ(irq_parse("-1: 0 x\n", &irq), -EBADMSG);
	CHECK_EQ(irq.number, 77);
}

TEST(doctor_irq, a_user_is_a_word_and_not_a_part_of_one)
{
	struct irq irq = { .name = "GICv2 189 Level     mmc0, virtio1-input.0" };

	CHECK(irq_is_of(&irq, "mmc0"));
	CHECK(irq_is_of(&irq, "virtio1"));
	CHECK(!irq_is_of(&irq, "virtio"));
	CHECK(!irq_is_of(&irq, "input"));
	CHECK(!irq_is_of(&irq, "irtio1"));
	CHECK(!irq_is_of(&irq, ""));
	snprintf(irq.name, sizeof(irq.name), "IR-PCI-MSI 5 eth01 eth0");
	CHECK(irq_is_of(&irq, "eth0"));
	CHECK(!irq_is_of(&irq, "eth"));
}

TEST(doctor_irq, of_a_long_name_the_end_is_kept)
{
	struct irq irq;

	CHECK_EQ(irq_parse("5: 1 a-controller-with-a-name-that-is-longer-than-all-that-there-was "
			   "before ecat0\n",
			   &irq),
		 0);
	CHECK(irq_is_of(&irq, "ecat0"));
	CHECK_EQ(strlen(irq.name), sizeof(irq.name) - 1);
}
