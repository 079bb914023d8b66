/* SPDX-License-Identifier: MIT */
/** @file dt_fmi3.h
 *  What the two sources of the FMI 3.0 interface share.
 */
#ifndef DT_FMI3_H
#define DT_FMI3_H

#include "dt_fmu.h"
#include "dt_fmu_twin.h"
#include "fmi3Functions.h"

/** Status of a call; a failed one logs its message. */
fmi3Status dt_fmi3_finish(dt_fmu *fmu, int done);
/** Error with a message. */
fmi3Status dt_fmi3_refuse(dt_fmu *fmu, const char *text);

#endif
