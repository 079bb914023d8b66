/* SPDX-License-Identifier: MIT */
/* Runs the model over a table of inputs, for tests on a PC.
 *
 *     dt_run [hold] < inputs.csv > outputs.csv
 *
 * Input rows: time [s], engine torque [N m], pressure of the off-going and of the on-coming element
 * [Pa]; blank lines and those that start with a letter are skipped. Inputs are linear between rows,
 * or held. A failure is reported on stderr: 1 to 5 are those of dt_status, 6 a row that cannot be
 * read. */

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "dt_twin.h"

typedef enum { ROW, NO_MORE, NO_ROW } reading;

static reading read_row(double row[4]) {
    char line[256];
    while (fgets(line, sizeof line, stdin) != 0) {
        const int skipped = isalpha((unsigned char)line[0]) || line[strspn(line, " \t\r\n")] == 0;
        if (!skipped) {
            const int read =
                sscanf(line, "%lf,%lf,%lf,%lf", &row[0], &row[1], &row[2], &row[3]) == 4;
            return read ? ROW : NO_ROW;
        }
    }
    return NO_MORE;
}

static dt_inputs inputs_of(const double row[4]) {
    dt_inputs u;
    u.engine_torque = (dt_real)row[1];
    u.pressure[0] = (dt_real)row[2];
    u.pressure[1] = (dt_real)row[3];
    return u;
}

static void print_row(double time, const dt_outputs *y) {
    printf("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", time, (double)y->engine_speed,
           (double)y->output_speed, (double)y->wheel_speed, (double)y->twist,
           (double)y->output_torque);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        printf(",%.17g,%.17g,%d", (double)y->clutch_torque[j], (double)y->slip[j], (int)y->mode[j]);
    }
    printf(",%d\n", y->pieces);
}

static int failed(const char *what, int code, double time) {
    fprintf(stderr, "dt_run: %s after %.17g s\n", what, time);
    return code;
}

int main(int argc, char **argv) {
    static const char *const faults[] = {
        "completed",          "a parameter is out of range", "an input or step is out of range",
        "too many events",    "no friction mode fits",       "the engine stalled"};
    const int hold = argc > 1 && strcmp(argv[1], "hold") == 0;
    double before[4], now[4];
    dt_state state;
    dt_line line;
    dt_outputs y;
    if (read_row(before) != ROW) {
        return failed("no row of four numbers", 6, 0.0);
    }
    dt_inputs from = inputs_of(before);
    dt_line_begin(&line, &dt_twin_delays, &from);
    dt_status status = dt_begin(&state, &dt_twin_params, &dt_twin_start, &from, &y);
    if (status != DT_OK) {
        return failed(faults[status], (int)status, before[0]);
    }
    printf("time,engine_speed,output_speed,wheel_speed,twist,output_torque,"
           "clutch_torque_1,slip_1,mode_1,clutch_torque_2,slip_2,mode_2,pieces\n");
    print_row(before[0], &y);
    reading next_row;
    while ((next_row = read_row(now)) == ROW) {
        const dt_inputs next = inputs_of(now);
        status = dt_step_delayed(&state, &line, &dt_twin_params, &from, hold ? &from : &next,
                                 (dt_real)(now[0] - before[0]), &y);
        if (status != DT_OK) {
            return failed(faults[status], (int)status, before[0]);
        }
        print_row(now[0], &y);
        from = next;
        memcpy(before, now, sizeof now);
    }
    return next_row == NO_MORE ? 0 : failed("no row of four numbers", 6, before[0]);
}
