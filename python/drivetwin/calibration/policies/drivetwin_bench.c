/* SPDX-License-Identifier: MIT */
/*
 * Test bench between the core and the controller of the user: a wait before the request, a pedal, and faults of
 * signals. The sources of the controller are compiled with dt_step and dt_state_size under the names below.
 *
 * Numbers before those of the controller: their count, task [s], wait [s], n, a table of the pedal (n times [s],
 * n factors on the torque demand), m, and m faults of signal, begin [s], end [s], delay [s] and every.
 */
#include "drivetwin_controller.h"
#include <math.h>
#include <string.h>

extern size_t dt_user_state_size(void);
extern void dt_user_step(const double *, void *, const dt_inputs *, dt_commands *);
#undef dt_step
#undef dt_state_size

enum { DT_INPUTS = 8, DT_SIGNALS = 11, DT_HISTORY = 1024, DT_FAULT = 5, DT_LARGEST_ALIGNMENT = 16 };

/* Signals are the inputs, then the commands. */
typedef struct {
    double calls;
    double history[DT_HISTORY][DT_SIGNALS];
    double arrived[DT_SIGNALS];
    dt_commands given;
} bench_type;

enum { DT_OWN = (sizeof(bench_type) + DT_LARGEST_ALIGNMENT - 1) / DT_LARGEST_ALIGNMENT * DT_LARGEST_ALIGNMENT };

DT_EXPORT size_t dt_state_size(void)
{
    return DT_OWN + dt_user_state_size();
}

static double limit(double pressure, double highest)
{
    return pressure < 0.0 ? 0.0 : pressure > highest ? highest : pressure;
}

static void step_user(const double *numbers, bench_type *bench, const dt_inputs *in)
{
    dt_user_step(numbers + (size_t)numbers[0], (char *)bench + DT_OWN, in, &bench->given);
    bench->given.offgoing_pressure = limit(bench->given.offgoing_pressure, in->system_pressure);
    bench->given.oncoming_pressure = limit(bench->given.oncoming_pressure, in->system_pressure);
}

/* Spoil the signals from `first` to before `last` of the present call, whose true values are in the history. */
static void spoil(const double *numbers, bench_type *bench, double time, int first, int last, double *signals)
{
    const double *pedal = numbers + 4, *faults = pedal + 2 * (size_t)numbers[3];
    double active[DT_SIGNALS] = {0};
    int call = (int)bench->calls;
    for (int k = 0; k < (int)faults[0]; k++) {
        const double *fault = faults + 1 + DT_FAULT * k;
        int signal = (int)fault[0], late = (int)floor(fault[3] / numbers[1] + 0.5), every = (int)fault[4];
        if (signal < first || signal >= last || time < fault[1] || time >= fault[2])
            continue;
        if (late > 0)
            signals[signal] = bench->history[(call > late ? call - late : 0) % DT_HISTORY][signal];
        else if (every == 0 || call % every != 0) {
            signals[signal] = bench->arrived[signal];
            active[signal] = 1.0;
        }
    }
    for (int signal = first; signal < last; signal++)
        if (active[signal] == 0.0)
            bench->arrived[signal] = signals[signal];
}

DT_EXPORT void dt_step(const double *numbers, void *state, const dt_inputs *in, dt_commands *out)
{
    bench_type *bench = state;
    double *now = bench->history[(int)bench->calls % DT_HISTORY], signals[DT_SIGNALS];
    dt_inputs seen = *in;

    seen.engine_torque *= dt_lookup(numbers + 4, (size_t)numbers[3], in->time);
    if (bench->calls == 0.0) {
        dt_inputs before = seen;
        bench->given = *out;
        for (double k = floor(numbers[2] / numbers[1] + 0.5); k > 0.0; k -= 1.0) {
            before.time = in->time - k * numbers[1];
            step_user(numbers, bench, &before);
        }
    }
    memcpy(now, &seen, sizeof seen);
    memcpy(signals, now, sizeof seen);
    spoil(numbers, bench, in->time, 0, DT_INPUTS, signals);
    memcpy(&seen, signals, sizeof seen);
    step_user(numbers, bench, &seen);
    memcpy(now + DT_INPUTS, &bench->given, sizeof bench->given);
    memcpy(signals + DT_INPUTS, now + DT_INPUTS, sizeof bench->given);
    spoil(numbers, bench, in->time, DT_INPUTS, DT_SIGNALS, signals);
    memcpy(out, signals + DT_INPUTS, sizeof *out);
    bench->calls += 1.0;
}
