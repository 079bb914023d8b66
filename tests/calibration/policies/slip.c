/* SPDX-License-Identifier: MIT */
/* The built-in controller with a closed slip loop, written against the header. */
#include "drivetwin_controller.h"
#include <math.h>

enum { PREPARATION, INERTIA, LOCKING };

typedef struct {
    double fill_pressure, fill_time, kiss_pressure, torque_phase_time, handover_pressure;
    double hold_time, hold_pressure, release_time, inertia_pressure, sync_pressure, inertia_time;
    double end_slope, gain, integral_gain, lock_rate, lock_lead, reduction_depth, reduction_delay;
    double reduction_time, return_slip, return_time, task, direction;
} parameters_type;

typedef struct {
    int phase, returns;
    double start_time, start_slip, since, from, integral, remaining, return_since, return_from;
} state_type;

size_t dt_state_size(void)
{
    return sizeof(state_type);
}

static double ramp(double passed, double duration, double from, double to)
{
    if (passed >= duration)
        return to;
    if (passed <= 0.0)
        return from;
    return from + (to - from) * passed / duration;
}

static double sign(double value)
{
    return signbit(value) ? -1.0 : 1.0;
}

void dt_step(const double *numbers, void *memory, const dt_inputs *in, dt_commands *out)
{
    const parameters_type *p = (const parameters_type *)numbers;
    state_type *s = memory;
    double elapsed = in->time, last_oncoming = out->oncoming_pressure, remaining, rate, oncoming, passed;
    if (s->phase == PREPARATION && elapsed > 0.03 && fabs(in->offgoing_slip) > 1.5) {
        s->start_time = elapsed;
        s->start_slip = in->oncoming_slip;
        s->remaining = fabs(in->oncoming_slip);
        s->phase = INERTIA;
    }
    remaining = sign(s->start_slip) * in->oncoming_slip;
    rate = (remaining - s->remaining) / p->task;
    if (s->phase == INERTIA && (remaining + (rate < 0.0 ? rate : 0.0) * p->lock_lead < 0.5
                                || (elapsed - s->start_time > p->inertia_time && rate >= 0.0)
                                || elapsed - s->start_time > 2.5 * p->inertia_time)) {
        s->phase = LOCKING;
        s->since = elapsed;
        s->from = last_oncoming;
    }
    s->remaining = remaining;
    passed = elapsed - s->start_time;
    {
        int ends = s->phase == LOCKING
                   || (s->phase == INERTIA && remaining < p->return_slip * fabs(s->start_slip));
        if (ends && !s->returns) {
            s->returns = 1;
            s->return_since = elapsed;
            s->return_from = out->engine_torque;
        }
        if (s->phase == PREPARATION)
            out->engine_torque = in->engine_torque;
        else if (s->returns)
            out->engine_torque = ramp(elapsed - s->return_since, p->return_time, s->return_from, in->engine_torque);
        else
            out->engine_torque = ramp(passed - p->reduction_delay, p->reduction_time, in->engine_torque,
                                      in->engine_torque + p->direction * p->reduction_depth);
    }
    if (elapsed < p->hold_time)
        out->offgoing_pressure = ramp(elapsed, p->hold_time, in->system_pressure, p->hold_pressure);
    else
        out->offgoing_pressure = ramp(elapsed - p->hold_time, p->release_time, p->hold_pressure, 0.0);
    if (s->phase == LOCKING) {
        oncoming = s->from + p->lock_rate * (elapsed - s->since);
    } else if (s->phase == INERTIA) {
        double left = ramp(passed, p->inertia_time, 1.0, 0.0);
        double smooth = left * left * (3.0 - 2.0 * left);
        double plan = fabs(s->start_slip) * (p->end_slope * left + (1.0 - p->end_slope) * smooth);
        double error = remaining - plan;
        s->integral += p->integral_gain * error * p->task;
        oncoming = ramp(passed, p->inertia_time, p->inertia_pressure, p->sync_pressure)
                   + p->gain * error + s->integral;
    } else if (elapsed < 0.0) {
        oncoming = 0.0;
    } else if (elapsed < p->fill_time) {
        oncoming = p->fill_pressure;
    } else {
        oncoming = ramp(elapsed - p->fill_time, p->torque_phase_time, p->kiss_pressure, p->handover_pressure);
    }
    out->oncoming_pressure = oncoming;
}
