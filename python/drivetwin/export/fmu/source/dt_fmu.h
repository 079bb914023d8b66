/* SPDX-License-Identifier: MIT */
/** @file dt_fmu.h
 *  What an instance of the FMU is, whatever the version of the interface.
 */
#ifndef DT_FMU_H
#define DT_FMU_H

#include <stddef.h>

#include "dt_twin.h"

/** Value references. Parameters follow one another in the order of DT_FMU_PARAMETERS. */
enum {
    DT_FMU_TIME = 0,
    DT_FMU_INPUTS = 1,       /**< engine torque, pressures */
    DT_FMU_OUTPUTS = 10,     /**< speeds, twist, output torque, clutch torques, slips */
    DT_FMU_MODES = 30,       /**< friction mode of each clutch */
    DT_FMU_LOSS_LAW = 40,    /**< dt_loss_law */
    DT_FMU_LOCKED = 41,      /**< clutch that starts locked */
    DT_FMU_START = 50,       /**< speeds and twist a run starts from */
    DT_FMU_PARAMETERS_FROM = 100
};

/** Where in its life an instance is. */
typedef enum {
    DT_FMU_INSTANTIATED,
    DT_FMU_INITIALIZING,
    DT_FMU_STEPPING,
    DT_FMU_TERMINATED
} dt_fmu_phase;

/** What is saved and restored. */
typedef struct {
    dt_params params;
    dt_start start;
    dt_inputs inputs; /**< at the start of the next step */
    dt_inputs rates;  /**< of the inputs over the next step, per s */
    dt_state state;
    dt_line line;
    dt_outputs outputs;
    double time;
    dt_fmu_phase phase;
    int has_stepped; /**< whether the line holds the inputs so far */
    int is_changed; /**< whether parameters or start have been set since they were checked */
} dt_fmu_data;

/** An instance. `logger` and `environment` are the importer's. */
typedef struct {
    dt_fmu_data now;
    void *environment;
    void (*logger)(void);
    char name[128];
    char message[256]; /**< why the last call failed */
} dt_fmu;

/** Fresh instance, null without memory. */
dt_fmu *dt_fmu_new(const char *name);
/** Values and phase of a fresh instance. */
void dt_fmu_reset(dt_fmu *fmu);

/* All of these return true where they succeed, else `message` says why not. */

int dt_fmu_get(dt_fmu *fmu, unsigned reference, double *value);
int dt_fmu_set(dt_fmu *fmu, unsigned reference, double value);
int dt_fmu_get_integer(dt_fmu *fmu, unsigned reference, int *value);
int dt_fmu_set_integer(dt_fmu *fmu, unsigned reference, long long value);
/** Rate of an input over the next step. */
int dt_fmu_set_rate(dt_fmu *fmu, unsigned reference, double rate);
int dt_fmu_enter_initialization(dt_fmu *fmu, double start_time);
int dt_fmu_exit_initialization(dt_fmu *fmu);
/** Advance from `time` by `h`; inputs start at their values and follow their rates. */
int dt_fmu_do_step(dt_fmu *fmu, double time, double h);

/** Bytes of a saved state. */
size_t dt_fmu_state_size(void);
/** Copy of everything that changes, null without memory; freed with free(). */
dt_fmu_data *dt_fmu_save(const dt_fmu *fmu);
void dt_fmu_serialize(const dt_fmu_data *saved, void *bytes);
/** Null where the bytes are not those of a saved state of this model. */
dt_fmu_data *dt_fmu_deserialize(const void *bytes, size_t size);

#endif
