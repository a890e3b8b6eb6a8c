/* SPDX-License-Identifier: MIT */
/* The configuration file's grammar as a JSON Schema (draft 7), from the option table. */
#ifndef CLI_SCHEMA_H
#define CLI_SCHEMA_H

#include "program/json.h"

/**
 * Write it, as one line. It refuses unknown options, wrong types, units and words, and bounds of
 * plain numbers; bounds of durations and sizes, and options that do not fit each other, are what
 * `ecdaq config check` is for. Context: blocking.
 */
void schema_write(struct json *js);

#endif
