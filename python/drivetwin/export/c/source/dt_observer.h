/* SPDX-License-Identifier: MIT */
/** @file dt_observer.h
 *  Torques that no sensor shows, from speeds and engine torque, with drift of friction and load.
 *
 *  An extended Kalman filter on the model's own mechanism. Its state is the four states of the
 *  model, the scale of each clutch's friction law (1: as identified) and the constant load at the
 *  wheel. Speeds are measured; that a locked clutch does not slip counts as a third measurement.
 *  A clutch counts as locked while its measured slip is small and its capacity may suffice.
 *  Friction is learnt while one clutch alone is pressed and slips clearly. SI units; no heap, no
 *  static mutable data, bounded loops.
 */
#ifndef DT_OBSERVER_H
#define DT_OBSERVER_H

#include "dt_model.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DT_OBSERVED 7            /**< states of the filter */
#define DT_OBSERVER_SUBSTEP 1e-3 /**< longest prediction at once, s */
#define DT_MOST_SPEED 1e5        /**< largest |measured speed|, rad/s: beyond any driveline */
#define DT_OBSERVER_SUBSTEPS 32  /**< most predictions in one call: calls every 32 ms or faster */

/** Index of a state of the filter; the first four are those of the model. */
enum { DT_SCALE = 4, DT_LOAD = 6 };

/** Noise of sensors and of what drifts; standard deviations, all > 0. */
typedef struct {
    dt_real engine_speed;  /**< noise of the sensor, rad/s */
    dt_real output_speed;  /**< noise of the sensor, rad/s */
    dt_real engine_torque; /**< error of the engine torque, N m, over 10 ms */
    dt_real scale;         /**< drift of the friction scale while it is learnt, 1 over 1 s */
    dt_real load;          /**< drift of the load at the wheel, N m over 1 s */
    dt_real locked_slip;   /**< slip below which a pressed clutch counts as locked, rad/s */
} dt_tuning;

/** Everything that lives from call to call. */
typedef struct {
    dt_real x[DT_OBSERVED];
    dt_real P[DT_OBSERVED][DT_OBSERVED]; /**< covariance */
    int locked;                          /**< index of the locked clutch, -1: none */
    int learning;                        /**< index of the clutch that tells friction, -1: none */
} dt_observer;

/** What is measured, and the inputs that were at work since the last call. */
typedef struct {
    dt_inputs inputs;
    dt_real engine_speed; /**< rad/s, at most DT_MOST_SPEED in size */
    dt_real output_speed; /**< rad/s, at most DT_MOST_SPEED in size */
} dt_measured;

/** Estimates with standard deviations. */
typedef struct {
    dt_real output_torque;              /**< in the output shaft, N m */
    dt_real output_torque_std;          /**< N m */
    dt_real clutch_torque[DT_CLUTCHES]; /**< N m */
    dt_real scale[DT_CLUTCHES];         /**< friction over that of the parameters, 1 */
    dt_real scale_std[DT_CLUTCHES];     /**< 1 */
    dt_real load;                       /**< constant load at the wheel, N m */
    dt_real load_std;                   /**< N m */
    dt_real slip[DT_CLUTCHES];          /**< rad/s */
    int locked;                         /**< index of the locked clutch, -1: none */
} dt_estimates;

/** Tuning for sensors as vehicles have them. */
dt_tuning dt_usual_tuning(void);

/** Start at measured speeds, the load as in the parameters, friction as identified. */
void dt_observer_begin(dt_observer *observer, const dt_params *params, const dt_measured *now);

/** Start anew at measured speeds, with friction and load as known so far: after a stop, or where
 *  calls have been missed. */
void dt_observer_resume(dt_observer *observer, const dt_params *params, const dt_measured *now);

/** Take in what is measured `h` [s] after the last call. Returns DT_BAD_STATE, and leaves the
 *  observer and the estimates as they are, where a value or h is not in range; also where one of
 *  them would not be finite, as after a start at speeds that were not: begin anew. */
dt_status dt_observe(dt_observer *observer, const dt_params *params, const dt_tuning *tuning,
                     const dt_measured *now, dt_real h, dt_estimates *estimates);

#ifdef __cplusplus
}
#endif

#endif
