/* SPDX-License-Identifier: MIT */
/** @file dt_twin.h
 *  The identified parameters; dt_twin.c holds their values with units.
 */
#ifndef DT_TWIN_H
#define DT_TWIN_H

#include "dt_delay.h"
#include "dt_model.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Parameters as identified; copy them to change them. */
extern const dt_params dt_twin_params;
/** Where a run starts unless set otherwise: steadily in the old gear. */
extern const dt_start dt_twin_start;
/** Delays of the inputs for dt_line_begin; zero where the model takes acting inputs. */
extern const dt_delays dt_twin_delays;
/** Name of the twin. */
extern const char dt_twin_name[];
/** Names of the shift elements: off-going, on-coming. */
extern const char *const dt_twin_clutch_names[DT_CLUTCHES];

#ifdef __cplusplus
}
#endif

#endif
