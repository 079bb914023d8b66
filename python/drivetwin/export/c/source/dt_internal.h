/* SPDX-License-Identifier: MIT */
/** @file dt_internal.h
 *  What the sources of the model share; not for users.
 */
#ifndef DT_INTERNAL_H
#define DT_INTERNAL_H

#include "dt_model.h"

/** Taylor coefficients of a scalar in time, value(t0 + t) = sum c_k t^k. */
typedef dt_real dt_series[DT_TERMS];

/** The linear mechanism for one direction of power. */
typedef struct {
    dt_real row[DT_ROWS][3];   /**< slip over engine, output and wheel speed */
    dt_real share[DT_ROWS][3]; /**< speeds that a unit of momentum along a row gives */
    dt_real inverse[2][2];     /**< inverse mass of engine and output */
    dt_real efficiency;        /**< what the input gear passes on: eta or 1 / eta */
} dt_mechanism;

/** Expansion in time of the whole motion in one friction mode. */
typedef struct {
    int order; /**< highest coefficient that is filled in */
    dt_series x[DT_STATES];
    dt_series size[DT_CLUTCHES];        /**< |slip| of a slipping clutch */
    dt_series exponential[DT_CLUTCHES]; /**< exp(-|slip| / v_s) */
    dt_series mu[DT_CLUTCHES];
    dt_series torque[DT_ROWS];
    dt_series shaft;            /**< torque in the output shaft */
    dt_series through;          /**< torque that enters the input gear */
    dt_real engine_torque[2];   /**< value and rate */
    dt_real normal[DT_ROWS][2]; /**< gain (P - P0), value and rate */
} dt_expansion;

/** What ends a piece before its time. */
typedef enum {
    DT_NOTHING,
    DT_AT_REST,        /**< slip reaches zero */
    DT_PRESSED,        /**< the normal load sets in or is gone */
    DT_OVERLOAD,       /**< the torque of a row at rest leaves its bounds */
    DT_POWER_REVERSAL, /**< the torque through the input gear changes its sign */
    DT_CELL,           /**< |slip| enters another piece of its friction table */
    DT_WHEEL_REVERSAL, /**< the wheel changes its direction of motion */
    DT_STALL           /**< the engine comes to rest */
} dt_cause;

/** The first event of a piece. */
typedef struct {
    dt_cause cause;
    int row;
    int sign;   /**< of the torque of an overload; of the step to the next cell */
    dt_real at; /**< s after the start of the piece */
} dt_event;

static inline int dt_slips(dt_mode mode) { return mode == DT_FORWARD || mode == DT_BACKWARD; }

static inline dt_real dt_direction(dt_mode mode) {
    return mode == DT_FORWARD ? DT_C(1) : (mode == DT_BACKWARD ? DT_C(-1) : DT_C(0));
}

static inline dt_real dt_slip(const dt_mechanism *m, int row, const dt_real *speeds) {
    return m->row[row][0] * speeds[0] + m->row[row][1] * speeds[1] + m->row[row][2] * speeds[2];
}

/** Value of a series at t, by Horner's rule. */
dt_real dt_value(const dt_real *c, int order, dt_real t);

void dt_mechanism_of(dt_mechanism *m, const dt_params *p, int power_backward);

/** mu at zero slip. */
dt_real dt_mu_rest(const dt_friction *friction);
/** Piece of a friction table that holds |slip| `s`; 0 where there is no table. */
int dt_cell_at(const dt_friction *friction, dt_real s);
/** Ends of a cell; true where it has an upper one. */
int dt_cell_span(const dt_friction *friction, int cell, dt_real *from, dt_real *to);
/** Coefficient k of mu along the coefficients of |slip|. */
void dt_mu_term(const dt_friction *friction, int cell, dt_expansion *e, int clutch, int k);

/** Normal loads and engine torque at `from` + `rate` t, as the expansion takes them. */
void dt_set_inputs(dt_expansion *e, const dt_params *p, const dt_inputs *at, const dt_inputs *rate);
/** Coefficients k of all torques and k + 1 of the state. */
void dt_expand_term(dt_expansion *e, const dt_mechanism *m, const dt_params *p, const dt_state *s,
                    int k);
/** Expand from the state; returns the part of `h` over which truncation stays within tolerance. */
dt_real dt_expand(dt_expansion *e, const dt_mechanism *m, const dt_params *p, const dt_state *s,
                  dt_real h);

/** First time in [0, h] from which the polynomial is negative; false if there is none. */
int dt_first_fall(const dt_real *c, int order, dt_real h, dt_real *at);

/** The earliest event within h of the start of the expansion. */
dt_event dt_earliest(const dt_expansion *e, const dt_mechanism *m, const dt_params *p,
                     const dt_state *s, dt_real h);

/** Whether inputs are numbers in range. */
int dt_inputs_in_range(const dt_inputs *inputs);
/** What tells one set of parameters from another. */
uint64_t dt_mark(const dt_params *p);
/** Whether the slip of a row is zero within `round_off` of the speeds behind it. */
int dt_at_rest(const dt_mechanism *m, const dt_real *x, int row, dt_real round_off);
/** Remove the round-off slip of all rows at rest and of row `more` (-1: none). */
void dt_bring_to_rest(dt_state *s, const dt_mechanism *m, int more);
/** Give a row a normal load or take it away. */
void dt_press(dt_state *s, const dt_mechanism *m, int row, int pressed);
/** Decide anew the modes of all rows at zero slip. `overload` has just reached its bound (cause
 *  DT_NOTHING: none has); inputs are those of the expansion, which is working space. */
dt_status dt_decide(dt_state *s, const dt_params *p, dt_expansion *e, dt_event overload,
                    dt_real remaining);

#endif
