/* SPDX-License-Identifier: MIT */
/* A shared object, but no control program. */
extern int not_a_program;
int not_a_program = 1;
