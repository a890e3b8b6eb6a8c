/* SPDX-License-Identifier: MIT */
#ifndef SIM_SIMULATOR_LIST_SLAVES_H
#define SIM_SIMULATOR_LIST_SLAVES_H

/** Print the slaves that --slaves knows by name, as a Markdown table. 0 or -ENOMEM. */
int list_slaves(void);

#endif
