/* SPDX-License-Identifier: MIT */
/* An instance of the FMU, whatever the version of the interface: variables, steps, saved states. */

#include "dt_fmu.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dt_fmu_twin.h"

#ifdef DT_FLOAT
#error "the interface carries double precision: compile the FMU without DT_FLOAT"
#endif


#define LONGEST_STEP 5e-3 /* s, within which dt_step needs few pieces */
#define COUNT(array) (sizeof(array) / sizeof((array)[0]))
#define PLACE(field) offsetof(dt_params, field),

static const size_t parameter_places[] = {DT_FMU_PARAMETERS(PLACE)};
static const size_t start_places[] = {
    offsetof(dt_start, engine_speed), offsetof(dt_start, output_speed),
    offsetof(dt_start, wheel_speed), offsetof(dt_start, twist)};
static const size_t input_places[] = {offsetof(dt_inputs, engine_torque),
                                      offsetof(dt_inputs, pressure[0]),
                                      offsetof(dt_inputs, pressure[1])};
static const size_t output_places[] = {
    offsetof(dt_outputs, engine_speed),     offsetof(dt_outputs, output_speed),
    offsetof(dt_outputs, wheel_speed),      offsetof(dt_outputs, twist),
    offsetof(dt_outputs, output_torque),    offsetof(dt_outputs, clutch_torque[0]),
    offsetof(dt_outputs, clutch_torque[1]), offsetof(dt_outputs, slip[0]),
    offsetof(dt_outputs, slip[1])};

static const char *const faults[] = {
    "completed",
    "a parameter is out of range",
    "a state, input or output is not a finite number in range",
    "more events in one step than can be separated",
    "no friction mode fits",
    "the engine stands or turns backward, which the dissipative loss law does not cover"};

static int fail(dt_fmu *fmu, const char *text, const char *detail) {
    snprintf(fmu->message, sizeof fmu->message, "%s: %s%s", fmu->name, text, detail);
    return 0;
}

/* Number behind a reference in a structure, null where there is none. */
static double *place_of(void *structure, const size_t *places, size_t count, unsigned reference,
                        unsigned first) {
    if (reference < first || reference - first >= count) {
        return 0;
    }
    return (double *)(void *)((char *)structure + places[reference - first]);
}

#define PLACE_OF(structure, places, reference, first) \
    place_of(structure, places, COUNT(places), reference, first)

dt_fmu *dt_fmu_new(const char *name) {
    dt_fmu *fmu = calloc(1, sizeof *fmu);
    if (fmu != 0) {
        snprintf(fmu->name, sizeof fmu->name, "%s", name != 0 ? name : dt_twin_name);
        dt_fmu_reset(fmu);
    }
    return fmu;
}

void dt_fmu_reset(dt_fmu *fmu) {
    memset(&fmu->now, 0, sizeof fmu->now);
    fmu->now.params = dt_twin_params;
    fmu->now.start = dt_twin_start;
    fmu->now.is_changed = 1;
}

/* Until initialization ends, outputs are those that the start as set would give. */
static int refresh(dt_fmu *fmu) {
    dt_fmu_data *now = &fmu->now;
    if (now->phase != DT_FMU_INITIALIZING || !now->is_changed) {
        return 1;
    }
    const char *fault = dt_check(&now->params);
    if (fault != 0) {
        return fail(fmu, "parameter out of range: ", fault);
    }
    const dt_status status =
        dt_begin(&now->state, &now->params, &now->start, &now->inputs, &now->outputs);
    if (status != DT_OK) {
        return fail(fmu, "cannot start: ", faults[status]);
    }
    now->is_changed = 0;
    return 1;
}

int dt_fmu_get(dt_fmu *fmu, unsigned reference, double *value) {
    dt_fmu_data *now = &fmu->now;
    if (reference == DT_FMU_TIME) {
        *value = now->time;
        return 1;
    }
    double *place = PLACE_OF(&now->inputs, input_places, reference, DT_FMU_INPUTS);
    place = place != 0 ? place : PLACE_OF(&now->start, start_places, reference, DT_FMU_START);
    place = place != 0 ? place
                       : PLACE_OF(&now->params, parameter_places, reference,
                                  DT_FMU_PARAMETERS_FROM);
    if (place == 0) {
        place = PLACE_OF(&now->outputs, output_places, reference, DT_FMU_OUTPUTS);
        if (place != 0 && !refresh(fmu)) {
            return 0;
        }
    }
    if (place == 0) {
        return fail(fmu, "unknown value reference", "");
    }
    *value = *place;
    return 1;
}

int dt_fmu_set(dt_fmu *fmu, unsigned reference, double value) {
    dt_fmu_data *now = &fmu->now;
    double *place = PLACE_OF(&now->inputs, input_places, reference, DT_FMU_INPUTS);
    if (place == 0) {
        place = PLACE_OF(&now->params, parameter_places, reference, DT_FMU_PARAMETERS_FROM);
    }
    if (place == 0) {
        place = PLACE_OF(&now->start, start_places, reference, DT_FMU_START);
        if (place != 0 && now->phase >= DT_FMU_STEPPING) {
            return fail(fmu, "a start value cannot be set after initialization", "");
        }
    }
    if (place == 0) {
        return fail(fmu, "value reference cannot be set", "");
    }
    if (!(value - value >= 0.0)) {
        return fail(fmu, "not a finite number", "");
    }
    *place = value;
    now->is_changed = 1;
    return 1;
}

int dt_fmu_get_integer(dt_fmu *fmu, unsigned reference, int *value) {
    const dt_fmu_data *now = &fmu->now;
    if (reference == DT_FMU_LOSS_LAW) {
        *value = (int)now->params.loss_law;
    } else if (reference == DT_FMU_LOCKED) {
        *value = now->start.locked;
    } else if (reference >= DT_FMU_MODES && reference < DT_FMU_MODES + DT_CLUTCHES) {
        if (!refresh(fmu)) {
            return 0;
        }
        *value = (int)now->outputs.mode[reference - DT_FMU_MODES];
    } else {
        return fail(fmu, "unknown value reference", "");
    }
    return 1;
}

int dt_fmu_set_integer(dt_fmu *fmu, unsigned reference, long long value) {
    dt_fmu_data *now = &fmu->now;
    if (now->phase >= DT_FMU_STEPPING) {
        return fail(fmu, "this value cannot be set after initialization", "");
    }
    if (reference == DT_FMU_LOSS_LAW && (value == DT_PAPER || value == DT_DISSIPATIVE)) {
        now->params.loss_law = value == DT_PAPER ? DT_PAPER : DT_DISSIPATIVE;
    } else if (reference == DT_FMU_LOCKED && value >= 0 && value <= DT_CLUTCHES) {
        now->start.locked = (int)value;
    } else {
        return fail(fmu, "not a value of this variable", "");
    }
    now->is_changed = 1;
    return 1;
}

int dt_fmu_set_rate(dt_fmu *fmu, unsigned reference, double rate) {
    double *place = PLACE_OF(&fmu->now.rates, input_places, reference, DT_FMU_INPUTS);
    if (place == 0 || !(rate - rate >= 0.0)) {
        return fail(fmu, "only inputs have derivatives, and these are finite", "");
    }
    *place = rate;
    return 1;
}

int dt_fmu_enter_initialization(dt_fmu *fmu, double start_time) {
    if (fmu->now.phase != DT_FMU_INSTANTIATED) {
        return fail(fmu, "initialization starts from a fresh or reset instance", "");
    }
    fmu->now.time = start_time;
    fmu->now.phase = DT_FMU_INITIALIZING;
    return 1;
}

int dt_fmu_exit_initialization(dt_fmu *fmu) {
    if (fmu->now.phase != DT_FMU_INITIALIZING) {
        return fail(fmu, "initialization has not been entered", "");
    }
    if (!refresh(fmu)) {
        return 0;
    }
    fmu->now.phase = DT_FMU_STEPPING;
    return 1;
}

static dt_inputs moved(const dt_inputs *from, const dt_inputs *rates, double h) {
    dt_inputs to;
    to.engine_torque = from->engine_torque + rates->engine_torque * h;
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        to.pressure[j] = from->pressure[j] + rates->pressure[j] * h;
    }
    return to;
}

int dt_fmu_do_step(dt_fmu *fmu, double time, double h) {
    dt_fmu_data *now = &fmu->now;
    const dt_inputs held = {0, {0}};
    if (now->phase != DT_FMU_STEPPING) {
        return fail(fmu, "a step needs an initialized instance", "");
    }
    if (!(h >= 0.0) || h - h < 0.0 || !(time - time >= 0.0)) {
        return fail(fmu, "time and step must be finite, the step not negative", "");
    }
    const char *fault = now->is_changed ? dt_check(&now->params) : 0;
    if (fault != 0) {
        return fail(fmu, "parameter out of range: ", fault);
    }
    const dt_fmu_data before = *now;
    if (!now->has_stepped) {
        dt_line_begin(&now->line, &dt_twin_delays, &now->inputs);
        now->has_stepped = 1;
    }
    const double parts = ceil(h / LONGEST_STEP);
    for (double part = 0.0; part < parts; part += 1.0) {
        const dt_inputs to = moved(&now->inputs, &now->rates, h / parts);
        const dt_status status = dt_step_delayed(&now->state, &now->line, &now->params,
                                                 &now->inputs, &to, h / parts, &now->outputs);
        if (status != DT_OK) {
            *now = before; /* the parts done so far as well */
            return fail(fmu, "step failed: ", faults[status]);
        }
        now->inputs = to;
    }
    now->is_changed = 0;
    now->rates = held;
    now->time = time + h;
    return 1;
}

/* A saved state as bytes: a mark of the model and its layout, then the data. */
typedef struct {
    char token[64];
    dt_fmu_data data;
} saved_bytes;

size_t dt_fmu_state_size(void) { return sizeof(saved_bytes); }

dt_fmu_data *dt_fmu_save(const dt_fmu *fmu) {
    dt_fmu_data *saved = malloc(sizeof *saved);
    if (saved != 0) {
        *saved = fmu->now;
    }
    return saved;
}

void dt_fmu_serialize(const dt_fmu_data *saved, void *bytes) {
    saved_bytes packed;
    memset(&packed, 0, sizeof packed);
    snprintf(packed.token, sizeof packed.token, "%s", DT_FMU_TOKEN);
    packed.data = *saved;
    memcpy(bytes, &packed, sizeof packed);
}

dt_fmu_data *dt_fmu_deserialize(const void *bytes, size_t size) {
    saved_bytes packed;
    if (size != sizeof packed) {
        return 0;
    }
    memcpy(&packed, bytes, sizeof packed);
    if (strncmp(packed.token, DT_FMU_TOKEN, sizeof packed.token) != 0) {
        return 0;
    }
    dt_fmu_data *saved = malloc(sizeof *saved);
    if (saved != 0) {
        *saved = packed.data;
    }
    return saved;
}
