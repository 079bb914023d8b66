/* SPDX-License-Identifier: MIT */
/* FMI 3.0: what the interface asks for and this FMU does not provide; every call says so. */

#include "dt_fmi3.h"

#define REFUSED return dt_fmi3_refuse(instance, "not provided by this FMU")

/* There are no variables of these types. */
#define NO_VARIABLES(name, type)                                                                   \
    fmi3Status name(fmi3Instance instance, const fmi3ValueReference valueReferences[],             \
                    size_t nValueReferences, type values[], size_t nValues) {                      \
        (void)valueReferences, (void)values, (void)nValues;                                        \
        return nValueReferences == 0                                                               \
                   ? fmi3OK                                                                        \
                   : dt_fmi3_refuse(instance, "there are no variables of this type");              \
    }
#define NO_TYPE(get, set, type) NO_VARIABLES(get, type) NO_VARIABLES(set, const type)
NO_TYPE(fmi3GetFloat32, fmi3SetFloat32, fmi3Float32)
NO_TYPE(fmi3GetInt8, fmi3SetInt8, fmi3Int8)
NO_TYPE(fmi3GetUInt8, fmi3SetUInt8, fmi3UInt8)
NO_TYPE(fmi3GetInt16, fmi3SetInt16, fmi3Int16)
NO_TYPE(fmi3GetUInt16, fmi3SetUInt16, fmi3UInt16)
NO_TYPE(fmi3GetUInt32, fmi3SetUInt32, fmi3UInt32)
NO_TYPE(fmi3GetUInt64, fmi3SetUInt64, fmi3UInt64)
NO_TYPE(fmi3GetBoolean, fmi3SetBoolean, fmi3Boolean)
NO_TYPE(fmi3GetString, fmi3SetString, fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)valueSizes, (void)values, (void)nValues;
    REFUSED;
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)valueSizes, (void)values, (void)nValues;
    REFUSED;
}

/* Other kinds of instances. */

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible;
    (void)loggingOn, (void)instanceEnvironment, (void)logMessage;
    return 0;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible;
    (void)loggingOn, (void)instanceEnvironment, (void)logMessage, (void)clockUpdate;
    (void)lockPreemption, (void)unlockPreemption;
    return 0;
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    REFUSED;
}

/* Modes. */

#define NO_MODE(name) fmi3Status name(fmi3Instance instance) { REFUSED; }
NO_MODE(fmi3EnterEventMode)
NO_MODE(fmi3EnterConfigurationMode)
NO_MODE(fmi3ExitConfigurationMode)
NO_MODE(fmi3EvaluateDiscreteStates)
NO_MODE(fmi3EnterContinuousTimeMode)
NO_MODE(fmi3EnterStepMode)

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    (void)discreteStatesNeedUpdate, (void)terminateSimulation;
    (void)nominalsOfContinuousStatesChanged, (void)valuesOfContinuousStatesChanged;
    (void)nextEventTimeDefined, (void)nextEventTime;
    REFUSED;
}

/* Dependencies and derivatives. */

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance,
                                               fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    REFUSED;
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents;
    (void)elementIndicesOfIndependents, (void)dependencyKinds, (void)nDependencies;
    REFUSED;
}

#define NO_DERIVATIVE(name)                                                                        \
    fmi3Status name(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,  \
                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],   \
                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {                \
        (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns;                              \
        (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;                            \
        REFUSED;                                                                                   \
    }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance,
                                    const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues;
    REFUSED;
}

/* Clocks. */

#define NO_CLOCK(name, ...)                                                                   \
    fmi3Status name(fmi3Instance instance, const fmi3ValueReference valueReferences[],        \
                    size_t nValueReferences, __VA_ARGS__)
NO_CLOCK(fmi3GetClock, fmi3Clock values[]) {
    (void)valueReferences, (void)nValueReferences, (void)values;
    REFUSED;
}
NO_CLOCK(fmi3SetClock, const fmi3Clock values[]) {
    (void)valueReferences, (void)nValueReferences, (void)values;
    REFUSED;
}
NO_CLOCK(fmi3GetIntervalDecimal, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    REFUSED;
}
NO_CLOCK(fmi3GetIntervalFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
         fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    (void)qualifiers;
    REFUSED;
}
NO_CLOCK(fmi3GetShiftDecimal, fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    REFUSED;
}
NO_CLOCK(fmi3GetShiftFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSED;
}
NO_CLOCK(fmi3SetIntervalDecimal, const fmi3Float64 intervals[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    REFUSED;
}
NO_CLOCK(fmi3SetIntervalFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSED;
}
NO_CLOCK(fmi3SetShiftDecimal, const fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    REFUSED;
}
NO_CLOCK(fmi3SetShiftFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSED;
}

/* Model exchange. */

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance,
                                       fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode,
                                       fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    REFUSED;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    (void)time;
    REFUSED;
}

#define NO_STATES(name, type)                                                \
    fmi3Status name(fmi3Instance instance, type values[], size_t nValues) {  \
        (void)values, (void)nValues;                                         \
        REFUSED;                                                             \
    }
NO_STATES(fmi3SetContinuousStates, const fmi3Float64)
NO_STATES(fmi3GetContinuousStates, fmi3Float64)
NO_STATES(fmi3GetContinuousStateDerivatives, fmi3Float64)
NO_STATES(fmi3GetEventIndicators, fmi3Float64)
NO_STATES(fmi3GetNominalsOfContinuousStates, fmi3Float64)

#define NO_COUNT(name)                                         \
    fmi3Status name(fmi3Instance instance, size_t *count) {    \
        (void)count;                                           \
        REFUSED;                                               \
    }
NO_COUNT(fmi3GetNumberOfEventIndicators)
NO_COUNT(fmi3GetNumberOfContinuousStates)
