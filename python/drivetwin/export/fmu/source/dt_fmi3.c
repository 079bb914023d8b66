/* SPDX-License-Identifier: MIT */
/* FMI 3.0 for co-simulation: what is provided. The rest is in dt_fmi3_absent.c. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dt_fmi3.h"

fmi3Status dt_fmi3_finish(dt_fmu *fmu, int done) {
    if (!done && fmu->logger != 0) {
        ((fmi3LogMessageCallback)fmu->logger)(fmu->environment, fmi3Error, "logStatusError",
                                              fmu->message);
    }
    return done ? fmi3OK : fmi3Error;
}

fmi3Status dt_fmi3_refuse(dt_fmu *fmu, const char *text) {
    snprintf(fmu->message, sizeof fmu->message, "%s: %s", fmu->name, text);
    return dt_fmi3_finish(fmu, 0);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    (void)instance, (void)loggingOn, (void)nCategories, (void)categories;
    return fmi3OK; /* errors are logged always, and there is nothing else to log */
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)resourcePath, (void)visible, (void)loggingOn, (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables, (void)intermediateUpdate;
    const char *fault = instantiationToken == 0 || strcmp(instantiationToken, DT_FMU_TOKEN) != 0
                            ? "the instantiation token is not that of this FMU"
                        : eventModeUsed ? "event mode is not provided"
                        : nRequiredIntermediateVariables > 0
                            ? "intermediate variables are not provided"
                            : 0;
    if (fault != 0) {
        if (logMessage != 0) {
            logMessage(instanceEnvironment, fmi3Error, "logStatusError", fault);
        }
        return 0;
    }
    dt_fmu *fmu = dt_fmu_new(instanceName);
    if (fmu != 0) {
        fmu->environment = instanceEnvironment;
        fmu->logger = (void (*)(void))logMessage;
    }
    return fmu;
}

void fmi3FreeInstance(fmi3Instance instance) { free(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    return dt_fmi3_finish(instance, dt_fmu_enter_initialization(instance, startTime));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    return dt_fmi3_finish(instance, dt_fmu_exit_initialization(instance));
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    ((dt_fmu *)instance)->now.phase = DT_FMU_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    dt_fmu_reset(instance);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues) {
    int done = nValues == nValueReferences;
    for (size_t i = 0; i < nValueReferences && done; ++i) {
        done = dt_fmu_get(instance, valueReferences[i], &values[i]);
    }
    return dt_fmi3_finish(instance, done);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues) {
    int done = nValues == nValueReferences;
    for (size_t i = 0; i < nValueReferences && done; ++i) {
        done = dt_fmu_set(instance, valueReferences[i], values[i]);
    }
    return dt_fmi3_finish(instance, done);
}

/* Integers are accessed as Int32, enumerations as Int64. */
#define INTEGERS(get, set, type)                                                              \
    fmi3Status get(fmi3Instance instance, const fmi3ValueReference valueReferences[],         \
                   size_t nValueReferences, type values[], size_t nValues) {                  \
        int done = nValues == nValueReferences;                                               \
        for (size_t i = 0; i < nValueReferences && done; ++i) {                               \
            int value = 0;                                                                    \
            done = dt_fmu_get_integer(instance, valueReferences[i], &value);                  \
            values[i] = value;                                                                \
        }                                                                                     \
        return dt_fmi3_finish(instance, done);                                                \
    }                                                                                         \
    fmi3Status set(fmi3Instance instance, const fmi3ValueReference valueReferences[],         \
                   size_t nValueReferences, const type values[], size_t nValues) {            \
        int done = nValues == nValueReferences;                                               \
        for (size_t i = 0; i < nValueReferences && done; ++i) {                               \
            done = dt_fmu_set_integer(instance, valueReferences[i], values[i]);               \
        }                                                                                     \
        return dt_fmi3_finish(instance, done);                                                \
    }
INTEGERS(fmi3GetInt32, fmi3SetInt32, fmi3Int32)
INTEGERS(fmi3GetInt64, fmi3SetInt64, fmi3Int64)

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    if (*FMUState != 0) {
        *(dt_fmu_data *)*FMUState = ((dt_fmu *)instance)->now;
        return fmi3OK;
    }
    *FMUState = dt_fmu_save(instance);
    return *FMUState != 0 ? fmi3OK : dt_fmi3_refuse(instance, "out of memory");
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    if (FMUState == 0) {
        return dt_fmi3_refuse(instance, "there is no saved state");
    }
    ((dt_fmu *)instance)->now = *(dt_fmu_data *)FMUState;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    (void)instance;
    if (FMUState != 0) {
        free(*FMUState);
        *FMUState = 0;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    (void)instance, (void)FMUState;
    *size = dt_fmu_state_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    if (FMUState == 0 || size < dt_fmu_state_size()) {
        return dt_fmi3_refuse(instance, "no saved state, or too little room for it");
    }
    dt_fmu_serialize(FMUState, serializedState);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState) {
    *FMUState = dt_fmu_deserialize(serializedState, size);
    return *FMUState != 0 ? fmi3OK
                          : dt_fmi3_refuse(instance, "these bytes are no saved state of this FMU");
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    const int done = dt_fmu_do_step(instance, currentCommunicationPoint, communicationStepSize);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = ((dt_fmu *)instance)->now.time;
    return dt_fmi3_finish(instance, done);
}
