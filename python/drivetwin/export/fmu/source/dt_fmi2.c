/* SPDX-License-Identifier: MIT */
/* FMI 2.0 for co-simulation. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dt_fmu.h"
#include "dt_fmu_twin.h"
#include "fmi2Functions.h"

/* The message is the format itself: importers exist that take no further arguments. */
static void log_error(const dt_fmu *fmu) {
    char format[2 * sizeof fmu->message];
    size_t end = 0;
    for (const char *from = fmu->message; *from != 0; ++from) {
        if (*from == '%') {
            format[end++] = '%';
        }
        format[end++] = *from;
    }
    format[end] = 0;
    ((fmi2CallbackLogger)fmu->logger)(fmu->environment, fmu->name, fmi2Error, "logStatusError",
                                      format);
}

static fmi2Status finish(dt_fmu *fmu, int done) {
    if (!done && fmu->logger != 0) {
        log_error(fmu);
    }
    return done ? fmi2OK : fmi2Error;
}

static fmi2Status refuse(dt_fmu *fmu, const char *text) {
    snprintf(fmu->message, sizeof fmu->message, "%s: %s", fmu->name, text);
    return finish(fmu, 0);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    (void)c, (void)loggingOn, (void)nCategories, (void)categories;
    return fmi2OK; /* errors are logged always, and there is nothing else to log */
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn) {
    (void)fmuResourceLocation, (void)visible, (void)loggingOn;
    if (fmuType != fmi2CoSimulation || fmuGUID == 0 || strcmp(fmuGUID, DT_FMU_TOKEN) != 0) {
        if (functions != 0 && functions->logger != 0) {
            functions->logger(functions->componentEnvironment, instanceName, fmi2Error,
                              "logStatusError",
                              fmuType != fmi2CoSimulation ? "only co-simulation is provided"
                                                          : "the GUID is not that of this FMU");
        }
        return 0;
    }
    dt_fmu *fmu = dt_fmu_new(instanceName);
    if (fmu != 0 && functions != 0) {
        fmu->environment = functions->componentEnvironment;
        fmu->logger = (void (*)(void))functions->logger;
    }
    return fmu;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    ((dt_fmu *)c)->now.time = startTime;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    dt_fmu *fmu = c;
    return finish(fmu, dt_fmu_enter_initialization(fmu, fmu->now.time));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return finish(c, dt_fmu_exit_initialization(c));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    ((dt_fmu *)c)->now.phase = DT_FMU_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    dt_fmu_reset(c);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       fmi2Real value[]) {
    int done = 1;
    for (size_t i = 0; i < nvr && done; ++i) {
        done = dt_fmu_get(c, vr[i], &value[i]);
    }
    return finish(c, done);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[]) {
    int done = 1;
    for (size_t i = 0; i < nvr && done; ++i) {
        done = dt_fmu_set(c, vr[i], value[i]);
    }
    return finish(c, done);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          fmi2Integer value[]) {
    int done = 1;
    for (size_t i = 0; i < nvr && done; ++i) {
        done = dt_fmu_get_integer(c, vr[i], &value[i]);
    }
    return finish(c, done);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Integer value[]) {
    int done = 1;
    for (size_t i = 0; i < nvr && done; ++i) {
        done = dt_fmu_set_integer(c, vr[i], value[i]);
    }
    return finish(c, done);
}

/* There are no Boolean and no String variables. */
#define NO_VARIABLES(name, type)                                                                \
    fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, type value[]) { \
        (void)vr, (void)value;                                                                  \
        return nvr == 0 ? fmi2OK : refuse(c, "there are no variables of this type");            \
    }
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    if (*FMUstate != 0) {
        *(dt_fmu_data *)*FMUstate = ((dt_fmu *)c)->now;
        return fmi2OK;
    }
    *FMUstate = dt_fmu_save(c);
    return *FMUstate != 0 ? fmi2OK : refuse(c, "out of memory");
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    if (FMUstate == 0) {
        return refuse(c, "there is no saved state");
    }
    ((dt_fmu *)c)->now = *(dt_fmu_data *)FMUstate;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    (void)c;
    if (FMUstate != 0) {
        free(*FMUstate);
        *FMUstate = 0;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    (void)c, (void)FMUstate;
    *size = dt_fmu_state_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate,
                                 fmi2Byte serializedState[], size_t size) {
    if (FMUstate == 0 || size < dt_fmu_state_size()) {
        return refuse(c, "no saved state, or too little room for it");
    }
    dt_fmu_serialize(FMUstate, serializedState);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    *FMUstate = dt_fmu_deserialize(serializedState, size);
    return *FMUstate != 0 ? fmi2OK : refuse(c, "these bytes are no saved state of this FMU");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown;
    (void)dvKnown, (void)dvUnknown;
    return refuse(c, "directional derivatives are not provided");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    int done = 1;
    for (size_t i = 0; i < nvr && done; ++i) {
        if (order[i] != 1) {
            return refuse(c, "inputs are linear over a step: only first derivatives");
        }
        done = dt_fmu_set_rate(c, vr[i], value[i]);
    }
    return finish(c, done);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    return refuse(c, "output derivatives are not provided");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    return finish(c, dt_fmu_do_step(c, currentCommunicationPoint, communicationStepSize));
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "steps are not asynchronous"); }

/* Steps return when they are done: there is never a pending status. */
#define NO_STATUS(name, type)                                                  \
    fmi2Status name(fmi2Component c, const fmi2StatusKind s, type *value) {    \
        (void)c, (void)s, (void)value;                                         \
        return fmi2Discard;                                                    \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    if (s != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = ((dt_fmu *)c)->now.time;
    return fmi2OK;
}
