/* SPDX-License-Identifier: MIT */
/*
 * Shift controller of five phases with a closed slip loop. The macro FAULT plants one of six bugs:
 * 1 sign of a ramp, 2 missing clamp, 3 counter that overflows, 4 unit of the temperature, 5 race of two flags,
 * 6 integrator without reset.
 */
#include "drivetwin_controller.h"
#include "ramps.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef FAULT
#define FAULT 0
#endif

enum { BEFORE, FILLING, TORQUE, INERTIA, LOCK_UP };

/* Numbers of regulator.toml in their order. */
typedef struct {
    double task;          /* s */
    double fill_time[8];  /* s over degC */
    double fill_pressure; /* bar */
    double kiss_pressure; /* bar */
    double hold;          /* bar above kiss per N m */
    double handover;      /* bar above kiss per N m */
    double torque_time;   /* s */
    double inertia;       /* bar above kiss per N m */
    double inertia_time;  /* s */
    double gain;          /* bar per rad/s */
    double integral_gain; /* bar per rad */
    double depth;         /* share of the demand */
    double torque_rate;   /* share of the demand per s */
    double lock_rate;     /* bar/s */
    double lock_slip;     /* rad/s */
    double slip_limit;    /* rad/s */
} numbers_type;

#if FAULT == 3
typedef uint8_t counter_type;
#else
typedef uint32_t counter_type;
#endif

typedef struct {
    counter_type ticks; /* tasks since the start of the program */
    counter_type begin; /* of the phase */
    int phase;
    int slip_seen;
    int slip_event;
    double slip;     /* at the begin of the inertia phase, rad/s */
    double integral; /* rad */
    double share;    /* engine torque over the demand */
    double oncoming; /* bar */
    double offgoing; /* bar */
    double released; /* off-going pressure at the begin of its release, bar */
} state_type;

static const double bar = 1e5;

size_t dt_state_size(void)
{
    return sizeof(state_type);
}

static double passed(const numbers_type *p, const state_type *s)
{
    return ((double)s->ticks - (double)s->begin) * p->task;
}

static void enter(state_type *s, int phase)
{
    s->phase = phase;
    s->begin = s->ticks;
}

/* Time of the filling at the oil temperature [s]. */
static double find_fill_time(const numbers_type *p, const dt_inputs *in)
{
#if FAULT == 4
    double celsius = in->oil_temperature;
#else
    double celsius = in->oil_temperature - 273.15;
#endif
    return dt_lookup(p->fill_time, 4, celsius);
}

static void watch_slip(const numbers_type *p, state_type *s, const dt_inputs *in)
{
    int slips = fabs(in->offgoing_slip) > p->slip_limit;
    s->slip_event = slips && !s->slip_seen;
    s->slip_seen = slips;
}

static int begins_inertia_phase(const numbers_type *p, const state_type *s)
{
    int late = passed(p, s) > p->torque_time + 0.25;
#if FAULT == 5
    int released = fabs(passed(p, s) - 1.15 * p->torque_time) < 0.5 * p->task;
    return !released && (s->slip_event || (late && !s->slip_seen));
#else
    return s->slip_seen || late;
#endif
}

static void fill(const numbers_type *p, state_type *s, const dt_inputs *in)
{
    double hold = p->kiss_pressure + p->hold * fabs(in->engine_torque);
    double fill_time = find_fill_time(p, in);
    s->oncoming = passed(p, s) < fill_time ? p->fill_pressure : p->kiss_pressure;
    s->offgoing = ramp_down(s->offgoing, hold, 100.0 * p->task);
    if (passed(p, s) >= fill_time + 0.04) {
        s->released = s->offgoing;
        enter(s, TORQUE);
    }
}

static void hand_over(const numbers_type *p, state_type *s, const dt_inputs *in)
{
    double share = passed(p, s) / p->torque_time;
    double target = p->handover * fabs(in->engine_torque);
    s->oncoming = p->kiss_pressure + target * clamp(share, 0.0, 1.6);
    s->offgoing = s->released * clamp(1.15 - share, 0.0, 1.0);
    if (begins_inertia_phase(p, s)) {
        enter(s, INERTIA);
        s->slip = in->oncoming_slip;
#if FAULT != 6
        s->integral = 0.0;
#endif
    }
}

static void follow_slip(const numbers_type *p, state_type *s, const dt_inputs *in)
{
    double left = clamp(1.0 - passed(p, s) / p->inertia_time, 0.0, 1.0);
    double reference = s->slip * left;
    double error = in->oncoming_slip - reference, correction;
    double forward = p->kiss_pressure + p->inertia * fabs(in->engine_torque);
    s->integral += error * p->task;
    correction = p->gain * error + p->integral_gain * s->integral;
    s->oncoming = forward + clamp(correction, -1.5, 1.5);
    s->offgoing = 0.0;
    s->share -= p->torque_rate * p->task;
#if FAULT != 2
    s->share = clamp(s->share, 1.0 - p->depth, 1.0);
#endif
    if (fabs(in->oncoming_slip) < p->lock_slip || in->oncoming_slip * s->slip < 0.0
        || passed(p, s) > p->inertia_time + 0.3)
        enter(s, LOCK_UP);
}

static void lock(const numbers_type *p, state_type *s, const dt_inputs *in)
{
    s->oncoming = ramp_up(s->oncoming, in->system_pressure / bar, p->lock_rate * p->task);
    s->offgoing = 0.0;
#if FAULT == 1
    s->share = clamp(s->share - p->torque_rate * p->task, 0.0, 1.0);
#else
    s->share = clamp(s->share + p->torque_rate * p->task, 0.0, 1.0);
#endif
}

void dt_step(const double *parameters, void *state, const dt_inputs *in, dt_commands *out)
{
    const numbers_type *p = (const numbers_type *)parameters;
    state_type *s = state;

    s->ticks++;
    watch_slip(p, s, in);
#if FAULT == 6
    if (s->phase != INERTIA)
        s->integral += (in->oncoming_slip - s->slip) * p->task;
#endif
    if (s->phase == BEFORE) {
        s->share = 1.0;
        s->oncoming = 0.0;
        s->offgoing = in->system_pressure / bar;
        if (in->time >= 0.0)
            enter(s, FILLING);
    }
    switch (s->phase) {
    case FILLING: fill(p, s, in); break;
    case TORQUE: hand_over(p, s, in); break;
    case INERTIA: follow_slip(p, s, in); break;
    case LOCK_UP: lock(p, s, in); break;
    default: break;
    }
    out->oncoming_pressure = bar * s->oncoming;
    out->offgoing_pressure = bar * s->offgoing;
    out->engine_torque = in->engine_torque * s->share;
}
