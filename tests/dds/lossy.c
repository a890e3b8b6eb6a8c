/* SPDX-License-Identifier: MIT */
/*
 * Preloaded into ecdaq-dds (LD_PRELOAD): Cyclone DDS then throws away ECDAQ_LOSS_PER_MILLE of the
 * packets it sends, by its own option for tests. The program itself takes no such setting.
 */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "dds/dds.h"

dds_entity_t dds_create_domain(const dds_domainid_t domain, const char *config)
{
	dds_entity_t (*real)(dds_domainid_t domain, const char *config);
	const char *loss = getenv("ECDAQ_LOSS_PER_MILLE");
	char lossy[4096];
	int len = snprintf(lossy, sizeof(lossy),
			   "%s<Internal><Test><XmitLossiness>%s</XmitLossiness></Test></Internal>",
			   config, loss == NULL ? "0" : loss);

	*(void **)&real = dlsym(RTLD_NEXT, "dds_create_domain");
	if (real == NULL || len < 0 || (size_t)len >= sizeof(lossy)) {
		return DDS_RETCODE_ERROR;
	}
	return real(domain, lossy);
}
