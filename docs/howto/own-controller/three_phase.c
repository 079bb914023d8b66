/* SPDX-License-Identifier: MIT */
/* Shift controller with three phases and four tables: preparation, inertia phase, lock-up. */
#include "drivetwin_controller.h"
#include <math.h>

enum { PREPARATION, INERTIA, LOCK_UP };

/* Numbers of three_phase.toml in their order. */
typedef struct {
    double oncoming[2 * 5]; /* bar over s since the request */
    double offgoing[2 * 4]; /* bar over s since the request */
    double inertia[2 * 4];  /* bar over the share of the slip that is left */
    double torque[2 * 4];   /* share of the demand over the share of the slip that is left */
    double lock_rate;       /* bar/s */
    double return_time;     /* s */
} numbers_type;

typedef struct {
    int phase;
    double slip;     /* at the begin of the inertia phase, rad/s */
    double since;    /* begin of the lock-up, s */
    double pressure; /* then, Pa */
    double torque;   /* then, N m */
} state_type;

size_t dt_state_size(void)
{
    return sizeof(state_type);
}

void dt_step(const double *parameters, void *state, const dt_inputs *in, dt_commands *out)
{
    const numbers_type *p = (const numbers_type *)parameters;
    state_type *s = state;
    const double bar = 1e5;
    double share;

    if (in->time < 0.0)
        return;
    if (s->phase == PREPARATION && in->time > 0.03 && fabs(in->offgoing_slip) > 1.5) {
        s->phase = INERTIA;
        s->slip = in->oncoming_slip;
    }
    share = s->slip != 0.0 ? in->oncoming_slip / s->slip : 1.0;
    if (s->phase == INERTIA && share < 0.02) {
        s->phase = LOCK_UP;
        s->since = in->time;
        s->pressure = out->oncoming_pressure;
        s->torque = out->engine_torque;
    }

    out->offgoing_pressure = bar * dt_lookup(p->offgoing, 4, in->time);
    if (s->phase == PREPARATION) {
        out->oncoming_pressure = bar * dt_lookup(p->oncoming, 5, in->time);
        out->engine_torque = in->engine_torque;
    } else if (s->phase == INERTIA) {
        out->oncoming_pressure = bar * dt_lookup(p->inertia, 4, share);
        out->engine_torque = in->engine_torque * dt_lookup(p->torque, 4, share);
    } else {
        double passed = in->time - s->since;
        double back = passed < p->return_time ? passed / p->return_time : 1.0;
        out->oncoming_pressure = s->pressure + bar * p->lock_rate * passed;
        out->engine_torque = s->torque + (in->engine_torque - s->torque) * back;
    }
}
