/* SPDX-License-Identifier: MIT */
/*
 * Interface of a shift controller that `drivetwin calibrate --controller` calibrates.
 *
 * A C file includes this header and defines both functions. drivetwin compiles it and calls
 * dt_step once per task of each simulated shift, from several threads at once: the functions keep
 * everything that changes in `state`, and have no variables of their own.
 *
 * Units are SI: s, rad/s, N m, Pa, K.
 */
#ifndef DRIVETWIN_CONTROLLER_H
#define DRIVETWIN_CONTROLLER_H

#include <stddef.h>

#if defined(_WIN32)
#define DT_EXPORT __declspec(dllexport)
#else
#define DT_EXPORT __attribute__((visibility("default")))
#endif

/* Quantities at a task. */
typedef struct {
    double time;            /* since the request of the gear; negative before it */
    double offgoing_slip;   /* slip of the off-going element */
    double oncoming_slip;   /* slip of the on-coming element */
    double engine_speed;
    double output_speed;    /* of the gearbox */
    double engine_torque;   /* demand of the driver */
    double system_pressure; /* largest pressure command */
    double oil_temperature;
} dt_inputs;

/* Commands that hold until the next task. At the call they contain the last ones; before the first
 * task these are the torque demand, system pressure and zero. Pressures are limited to the range
 * from zero to system pressure. */
typedef struct {
    double engine_torque;
    double offgoing_pressure;
    double oncoming_pressure;
} dt_commands;

/* Bytes of the state of one run. The state is filled with zeros before the first task. */
DT_EXPORT size_t dt_state_size(void);

/* One task. `parameters` are the numbers of the parameter file in its order and units; a table of n
 * points is its n breakpoints, then its n values. */
DT_EXPORT void dt_step(
    const double *parameters, void *state, const dt_inputs *inputs, dt_commands *commands);

/* Value of a table of n points at x: linear between the breakpoints, constant beyond them. */
static inline double dt_lookup(const double *table, size_t n, double x)
{
    const double *values = table + n;
    size_t i = 1;
    if (!(x > table[0]))
        return values[0];
    while (i < n && x > table[i])
        i++;
    if (i == n)
        return values[n - 1];
    return values[i - 1]
           + (values[i] - values[i - 1]) * (x - table[i - 1]) / (table[i] - table[i - 1]);
}

#endif
