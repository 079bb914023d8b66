/* SPDX-License-Identifier: MIT */
/* Delay lines of the inputs. */

#include "dt_delay.h"

#include "dt_internal.h"

void dt_line_begin(dt_line *line, const dt_delays *delays, const dt_inputs *inputs) {
    line->delays = *delays;
    line->newest = 0;
    for (int i = 0; i < DT_LINE; ++i) {
        line->sample[i] = *inputs;
        line->interval[i] = DT_C(0);
    }
}

/* Append the inputs `h` after the newest sample, or move that sample where both are close. */
static void append(dt_line *line, const dt_inputs *inputs, dt_real h) {
    const dt_real longest = dt_larger(line->delays.engine_torque, line->delays.pressure);
    const dt_real spacing = DT_C(2) * longest / DT_C(DT_LINE - 2);
    if (line->interval[line->newest] + h < spacing) {
        line->interval[line->newest] += h;
    } else {
        line->newest = (line->newest + 1) % DT_LINE;
        line->interval[line->newest] = h;
    }
    line->sample[line->newest] = *inputs;
}

/* Samples on both sides of an instant, and the weight of the earlier one. */
typedef struct {
    const dt_inputs *later, *earlier;
    dt_real weight;
} place;

/* Place of the instant `delay` before the newest sample. */
static place find_place(const dt_line *line, dt_real delay) {
    int at = line->newest;
    for (int k = 1; k < DT_LINE && delay > DT_C(0); ++k) {
        const int before = at > 0 ? at - 1 : DT_LINE - 1;
        const dt_real span = line->interval[at];
        if (delay < span) {
            const place between = {&line->sample[at], &line->sample[before], delay / span};
            return between;
        }
        delay -= span;
        at = before;
    }
    const place exact = {&line->sample[at], &line->sample[at], DT_C(0)};
    return exact;
}

static dt_real mix(dt_real later, dt_real earlier, dt_real weight) {
    return later + (earlier - later) * weight;
}

/* Inputs that act at the newest instant. */
static dt_inputs acting(const dt_line *line) {
    const place torque = find_place(line, line->delays.engine_torque);
    const place pressure = find_place(line, line->delays.pressure);
    dt_inputs found;
    found.engine_torque =
        mix(torque.later->engine_torque, torque.earlier->engine_torque, torque.weight);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        found.pressure[j] = mix(pressure.later->pressure[j], pressure.earlier->pressure[j],
                                pressure.weight);
    }
    return found;
}

dt_status dt_step_delayed(dt_state *state, dt_line *line, const dt_params *params,
                          const dt_inputs *from, const dt_inputs *to, dt_real h,
                          dt_outputs *outputs) {
    if (!dt_inputs_in_range(from) || !dt_inputs_in_range(to)) {
        return DT_BAD_STATE;
    }
    const int newest = line->newest, after = (newest + 1) % DT_LINE;
    const dt_inputs samples[2] = {line->sample[newest], line->sample[after]};
    const dt_real intervals[2] = {line->interval[newest], line->interval[after]};
    line->sample[newest] = *from; /* inputs may jump between steps */
    const dt_inputs first = acting(line);
    append(line, to, h);
    const dt_inputs last = acting(line);
    const dt_status status = dt_step(state, params, &first, &last, h, outputs);
    if (status != DT_OK) {
        line->newest = newest;
        line->sample[newest] = samples[0];
        line->sample[after] = samples[1];
        line->interval[newest] = intervals[0];
        line->interval[after] = intervals[1];
    }
    return status;
}
