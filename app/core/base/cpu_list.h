/* SPDX-License-Identifier: MIT */
/* Lists of cores as the kernel writes them: "1-3,5". Context: any. */
#ifndef BASE_CPU_LIST_H
#define BASE_CPU_LIST_H

/** 1 if @cpu is in @list; 0 also for what is no list ("", "(null)"). */
int cpu_list_has(const char *list, int cpu);

#endif
