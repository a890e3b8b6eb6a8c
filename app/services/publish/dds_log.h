/* SPDX-License-Identifier: MIT */
/*
 * What the DDS library has to say (of malformed packets, most of all), on stderr: bounded by
 * log_limit.h and in length, without control characters, for anybody on the network can cause it.
 */
#ifndef PUBLISH_DDS_LOG_H
#define PUBLISH_DDS_LOG_H

/** From now on. Before the domain is created. */
void dds_log_begin(void);
/** Tell how many lines were suppressed, when it is time. Call it now and then. */
void dds_log_tell(void);
/** The library's own log again. Tells what is left to tell. */
void dds_log_end(void);

#endif
