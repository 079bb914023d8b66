/* SPDX-License-Identifier: MIT */
/** @file dt_delay.h
 *  Delay lines from the inputs of an exported model to the acting inputs.
 *
 *  A log shows each signal with its own delay. No signal can be advanced in real time, so the model
 *  waits for the latest one: the lines delay the other inputs, and the outputs are later by the lag
 *  that dt_twin_delays states. With delays of zero a step is that of dt_step.
 *
 *  A line holds DT_LINE samples, about 4.1 kB in double precision. Inputs are linear between them.
 *  Samples that are closer together than 2 / (DT_LINE - 2) of the longest delay are merged, so any
 *  step is possible. Before the first sample the inputs are constant. Copy a line with the dt_state
 *  beside it to save both.
 *
 *  Cost of a step beside that of dt_step: at most 1200 operations.
 */
#ifndef DT_DELAY_H
#define DT_DELAY_H

#include "dt_model.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DT_LINE 128 /**< samples of a line */

/** Delays from the inputs to the acting ones, >= 0, and the lag of the outputs that follows. */
typedef struct {
    dt_real engine_torque; /**< s */
    dt_real pressure;      /**< of both clutches, s */
    dt_real lag;           /**< of the outputs behind the motion that they describe, s */
} dt_delays;

/** Delays and the samples of the inputs. */
typedef struct {
    dt_delays delays;
    dt_inputs sample[DT_LINE];
    dt_real interval[DT_LINE]; /**< from the sample before, s */
    int newest;
} dt_line;

/** Start a line at inputs that have been constant so far. */
void dt_line_begin(dt_line *line, const dt_delays *delays, const dt_inputs *inputs);

/** dt_step with inputs linear from `from` to `to` in front of the delay lines. Where the result is
 *  not DT_OK, the line is that of before the call, too. */
dt_status dt_step_delayed(dt_state *state, dt_line *line, const dt_params *params,
                          const dt_inputs *from, const dt_inputs *to, dt_real h,
                          dt_outputs *outputs);

#ifdef __cplusplus
}
#endif

#endif
