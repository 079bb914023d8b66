/* SPDX-License-Identifier: MIT */
/* What a step of the exported model and a call of its observer cost, over one shift.
 *
 * On a PC in nanoseconds, on a Cortex-M in instructions: its system timer counts 25 MHz of a
 * virtual clock that goes on by a nanosecond with every instruction. */

#include <stdint.h>
#include <stdio.h>

#include "dt_observer.h"
#include "dt_twin.h"
#include "inputs.h" /* INPUT_STEP, INPUT_ROWS, input_rows */

#ifdef __ARM_ARCH
#define SYSTICK ((volatile uint32_t *)0xE000E010)
#define PER_TICK 40.0
static void start_clock(void) {
    SYSTICK[1] = 0xFFFFFF;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5;
}
static uint32_t ticks(void) { return SYSTICK[2]; }
static uint32_t elapsed(uint32_t from, uint32_t to) { return (from - to) & 0xFFFFFF; }
#else
#include <time.h>
#define PER_TICK 1.0
static void start_clock(void) {}
static uint32_t ticks(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec);
}
static uint32_t elapsed(uint32_t from, uint32_t to) { return to - from; }
#endif

static dt_inputs row(int i) {
    const dt_inputs u = {input_rows[i][0], {input_rows[i][1], input_rows[i][2]}};
    return u;
}

static void print(const char *name, double sum, uint32_t most, int calls) {
    printf("%s %.0f %.0f\n", name, PER_TICK * sum / calls, PER_TICK * most);
}

int main(void) {
    dt_state state;
    dt_observer observer;
    dt_outputs y;
    dt_estimates estimates;
    const dt_tuning tuning = dt_usual_tuning();
    dt_inputs from = row(0);
    dt_measured seen = {from, dt_twin_start.engine_speed, dt_twin_start.output_speed};
    double steps = 0.0, calls = 0.0;
    uint32_t slowest_step = 0, slowest_call = 0;
    int pieces = 0;
    start_clock();
    int failures = dt_begin(&state, &dt_twin_params, &dt_twin_start, &from, &y) != DT_OK;
    dt_observer_begin(&observer, &dt_twin_params, &seen);
    for (int i = 1; i < INPUT_ROWS; ++i) {
        const dt_inputs to = row(i);
        const uint32_t first = ticks();
        failures += dt_step(&state, &dt_twin_params, &from, &to, INPUT_STEP, &y) != DT_OK;
        const uint32_t second = ticks();
        seen.inputs = from;
        seen.engine_speed = y.engine_speed;
        seen.output_speed = y.output_speed;
        const uint32_t third = ticks();
        failures += dt_observe(&observer, &dt_twin_params, &tuning, &seen, INPUT_STEP,
                               &estimates) != DT_OK;
        const uint32_t fourth = ticks();
        const uint32_t step = elapsed(first, second), call = elapsed(third, fourth);
        steps += step;
        calls += call;
        slowest_step = step > slowest_step ? step : slowest_step;
        slowest_call = call > slowest_call ? call : slowest_call;
        pieces = y.pieces > pieces ? y.pieces : pieces;
        from = to;
    }
    print("step", steps, slowest_step, INPUT_ROWS - 1);
    print("observer", calls, slowest_call, INPUT_ROWS - 1);
    printf("pieces %d %d\n", pieces, failures);
    return failures;
}
