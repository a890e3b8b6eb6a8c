/* SPDX-License-Identifier: MIT */
/*
 * EtherCAT Slave Information (ESI, ETG.2000): XML files in which vendors describe their devices.
 * Read is what a master needs: names, PDOs, SyncManagers, clock modes, mailboxes, start-up
 * commands, slots and modules. The object dictionary, pictures and vendor extensions are passed
 * over. Files may be anything: every number and every count is bounded. Texts are UTF-8, cut to
 * their field. Context: blocking.
 */
#ifndef ESI_ESI_H
#define ESI_ESI_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "esi/device.h"

/**
 * Read an ESI file; one that has devices before an error has handed these over. 0; -EBADMSG,
 * -ENOMEM, -errno of the file or of the visitor, with one line "FILE:LINE: ..." in @error.
 */
int esi_read_file(const char *path, const struct esi_visitor *visitor, char *error,
		  size_t error_bytes);
/** The same of @text; @name stands for its file. */
int esi_read(const char *name, const char *text, size_t len, const struct esi_visitor *visitor,
	     char *error, size_t error_bytes);

/**
 * Write @count devices as an ESI file that esi_read() reads: one <EtherCATInfo>, or several in an
 * <EtherCATInfoList>. Errors show in ferror(@out).
 */
void esi_write(FILE *out, const struct esi_device *const *device, size_t count);

#endif
