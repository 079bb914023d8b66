/* SPDX-License-Identifier: MIT */
/** @file dt_model.h
 *  Dual-clutch driveline with lock-up engaged: engine, two shift elements, output shaft, vehicle.
 *
 *  All quantities are SI: rad, s, N m, kg m^2, Pa. No heap, no recursion, no static mutable data,
 *  bounded loops; every function is reentrant. Speeds are positive forward, a clutch torque drives
 *  the output and loads the engine, slip = omega_in / i_c - i_out * omega_out.
 *
 *  Law of motion (alpha_k = 1 / (i_in i_c_k)):
 *      J2e w_e'   = phi(T_g) - sum alpha_k (T_k + I_k s_k'),    T_g = T_e - J1 w_e'
 *      J_out w_o' = sum i_out_k (T_k + I_k s_k') - T_o
 *      T_o        = k_o twist + c_o twist',                     twist' = w_o - i_f w_w
 *      J_v w_w'   = i_f T_o - constant - rolling Sgn(w_w) - aero w_w |w_w|
 *      T_k in cap_k Sgn(s_k),  cap_k = mu_k(|s_k|) gain_k (P_k - P0_k)
 *
 *  Cost: a piece of a step takes at most 273150 operations on floating point numbers in double
 *  precision and 145750 in single, a step at most DT_PIECES times as many, whatever the inputs;
 *  nearly all of that is a search for roots that in practice ends at its first test. Without an
 *  event a step of 1 ms is one piece and takes at most 3150 (double) or 1750 (single) for it and
 *  some 50 for each of up to 12 guards. Stack: below 4 kB in double precision.
 *
 *  phi(T) = eta T in every direction (loss law "paper"), or eta T with power from the engine and
 *  T / eta with power to it (loss law "dissipative").
 */
#ifndef DT_MODEL_H
#define DT_MODEL_H

#include "dt_real.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DT_CLUTCHES 2 /**< shift elements */
#define DT_ROWS 3     /**< friction elements: the clutches, then the rolling resistance */
#define DT_GUARDS 4    /**< what is released: the rows, then the power through the input gear */
#define DT_STATES 4   /**< engine, output and wheel speed, twist of the output shaft */
#define DT_POINTS 64  /**< most points of a friction table */
#ifndef DT_PIECES
#define DT_PIECES 64 /**< most pieces of one step, a piece ending at an event or where the
                          truncation error asks for it */
#endif
#define DT_MOST_TORQUE 1e7   /**< largest |engine torque|, N m: beyond any vehicle, not beyond float */
#define DT_MOST_PRESSURE 1e9 /**< largest |pressure|, Pa: steel yields before */

/** What a call came to. */
typedef enum {
    DT_OK = 0,
    DT_BAD_PARAMETER,   /**< a parameter is out of range; dt_check names it */
    DT_BAD_STATE,       /**< a state, input, step or output is not a finite number in range */
    DT_TOO_MANY_EVENTS, /**< DT_PIECES pieces did not reach the end of the step */
    DT_UNDECIDED,       /**< no friction mode fits; efficiencies that lock themselves */
    DT_ENGINE_STALLED   /**< under the dissipative loss law the engine stands or turns backward */
} dt_status;

/** How losses depend on the direction of power. */
typedef enum { DT_PAPER = 0, DT_DISSIPATIVE = 1 } dt_loss_law;

/** Friction mode of one element. */
typedef enum {
    DT_OPEN = 0,     /**< no capacity */
    DT_STUCK = 1,    /**< no slip, torque within the static capacity */
    DT_FORWARD = 2,  /**< positive slip */
    DT_BACKWARD = 3  /**< negative slip */
} dt_mode;

/** Index of a state. */
enum { DT_ENGINE = 0, DT_OUTPUT = 1, DT_WHEEL = 2, DT_TWIST = 3 };

/** mu over |slip|: a table where `points` > 0, else
 *  mu_c + (mu_s - mu_c) exp(-|s| / v_s) + mu_v |s|. */
typedef struct {
    dt_real mu_c;            /**< 1, >= 0 */
    dt_real mu_s;            /**< 1, >= 0 */
    dt_real v_s;             /**< rad/s, > 0 */
    dt_real mu_v;            /**< s/rad */
    int points;              /**< 0 to DT_POINTS */
    dt_real slip[DT_POINTS]; /**< rad/s, increasing from 0; mu is constant beyond the last */
    dt_real mu[DT_POINTS];   /**< 1, >= 0 */
} dt_friction;

/** A shift element. */
typedef struct {
    dt_real i_c;          /**< ratio between input gear and clutch, 1, not 0 */
    dt_real i_out;        /**< ratio between clutch and output, 1, not 0 */
    dt_real gain;         /**< surfaces * de-rating * area * effective radius, m^3, >= 0 */
    dt_real P0;           /**< pressure at which the fill ends, Pa */
    dt_real peak;         /**< static over kinetic capacity at zero slip, 1, >= 1 */
    dt_real drum_inertia; /**< inertia that turns with the slip, kg m^2, >= 0 */
    dt_friction friction;
} dt_clutch;

/** Parameters; may change between steps: what slips, holds or is open is then decided anew, from
 *  speeds and twist alone, as at a start. */
typedef struct {
    dt_real J1;            /**< inertia before the input gear, kg m^2, >= 0 */
    dt_real J2e;           /**< inertia from input gear to clutches, at the engine, kg m^2, >= 0 */
    dt_real eta;           /**< lumped efficiency, 1, 0 to 1.5 */
    dt_real i_in;          /**< input gear, 1, not 0 */
    dt_real J_out;         /**< output side before the shaft, kg m^2, > 0 */
    dt_real i_f;           /**< final drive, 1, not 0 */
    dt_real J_v;           /**< vehicle at the wheel, kg m^2, > 0 */
    dt_real k_o;           /**< output shaft stiffness, N m/rad, >= 0 */
    dt_real c_o;           /**< output shaft damping, N m s/rad, >= 0 */
    dt_real load_constant; /**< load at the wheel in either direction of motion, N m */
    dt_real load_rolling;  /**< load that opposes the motion, N m, >= 0 */
    dt_real load_aero;     /**< load that grows with speed squared, N m s^2/rad^2, >= 0 */
    dt_loss_law loss_law;
    dt_clutch clutch[DT_CLUTCHES];
} dt_params;

/** Inputs at one instant. */
typedef struct {
    dt_real engine_torque;         /**< N m, at most DT_MOST_TORQUE in size */
    dt_real pressure[DT_CLUTCHES]; /**< gauge pressure, Pa, at most DT_MOST_PRESSURE in size */
} dt_inputs;

/** Everything that lives from step to step. Copy it to save, copy it back to restore. */
typedef struct {
    dt_real x[DT_STATES];     /**< rad/s, rad/s, rad/s, rad */
    dt_real carry[DT_STATES]; /**< what rounding cut off x */
    dt_mode mode[DT_ROWS];
    int released[DT_GUARDS];    /**< whether a guard starts from exact zero at this instant */
    int cell[DT_CLUTCHES];      /**< piece of the friction table in use */
    int power_backward;         /**< whether power flows to the engine */
    int wheel_backward;         /**< whether the wheel turns backward */
    dt_inputs inputs;           /**< at the end of the last step */
    uint64_t params;            /**< dt_mark of its parameters */
} dt_state;

/** Outputs at the end of a step. */
typedef struct {
    dt_real engine_speed;               /**< rad/s */
    dt_real output_speed;               /**< rad/s */
    dt_real wheel_speed;                /**< rad/s */
    dt_real twist;                      /**< rad */
    dt_real output_torque;              /**< in the output shaft, N m */
    dt_real clutch_torque[DT_CLUTCHES]; /**< N m */
    dt_real slip[DT_CLUTCHES];          /**< rad/s */
    dt_mode mode[DT_CLUTCHES];
    int pieces; /**< pieces the step took, at most DT_PIECES */
} dt_outputs;

/** Where a run starts. */
typedef struct {
    dt_real engine_speed; /**< rad/s */
    dt_real output_speed; /**< rad/s */
    dt_real wheel_speed;  /**< rad/s */
    dt_real twist;        /**< rad */
    int locked;           /**< 0: none; k: clutch k, brought to zero slip by an impulse of its torque,
                               holds if it can */
} dt_start;

/** Null where all parameters are in range, else the name of the first that is not. */
const char *dt_check(const dt_params *params);

/** Take up a start at given inputs. State and outputs are written where the result is DT_OK. */
dt_status dt_begin(dt_state *state, const dt_params *params, const dt_start *start,
                   const dt_inputs *inputs, dt_outputs *outputs);

/** Advance by `h` [s] with inputs linear from `from` to `to` (the same twice: held).
 *
 *  Locks and break-aways are located inside the step to round-off. Inputs may jump between steps,
 *  and so may parameters, whose ranges are checked again.
 *  Where the result is not DT_OK, state and outputs are those of before the call, so that the run
 *  goes on with the next sound inputs. */
dt_status dt_step(dt_state *state, const dt_params *params, const dt_inputs *from,
                  const dt_inputs *to, dt_real h, dt_outputs *outputs);

/** mu of a law at |slip| `s` >= 0 [rad/s]. */
dt_real dt_mu(const dt_friction *friction, dt_real s);

#ifdef __cplusplus
}
#endif

#endif
