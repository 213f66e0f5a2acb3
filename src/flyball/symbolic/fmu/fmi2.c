/* FMI 2.0.4: model exchange and co-simulation. Declarations follow the standard's headers fmi2TypesPlatform.h,
   fmi2FunctionTypes.h and fmi2Functions.h. */
#include <stdlib.h>
#include <string.h>

#include "core.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

static Instance *of(fmi2Component c)
{
    return c;
}

EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
    const void *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name, (void)type, (void)resources, (void)functions, (void)visible, (void)logging;
    if (!token || strcmp(token, TOKEN))
        return NULL;
    Instance *s = malloc(sizeof *s);
    if (s)
        reset_instance(s);
    return s;
}

EXPORT void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
    fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_stop, (void)stop;
    if (has_tolerance && tolerance > 0.0)
        of(c)->tolerance = tolerance;
    set_value(c, 0, start);
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    of(c)->initializing = 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    project(c);
    of(c)->initializing = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    reset_instance(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real value[])
{
    update_values(c);
    for (size_t k = 0; k < n; k++) {
        if (at[k] >= VALUES)
            return fmi2Error;
        value[k] = of(c)->value[at[k]];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real value[])
{
    for (size_t k = 0; k < n; k++) {
        if (!may_be_set(c, at[k]))
            return fmi2Error;
        set_value(c, at[k], value[k]);
    }
    return fmi2OK;
}

#define NOTHING_TO_GET(name, type)                                                                           \
    EXPORT fmi2Status name(fmi2Component c, const fmi2ValueReference at[], size_t n, type value[])            \
    {                                                                                                         \
        (void)c, (void)at, (void)value;                                                                       \
        return n ? fmi2Error : fmi2OK;                                                                        \
    }
NOTHING_TO_GET(fmi2GetInteger, fmi2Integer)
NOTHING_TO_GET(fmi2GetBoolean, fmi2Boolean)
NOTHING_TO_GET(fmi2GetString, fmi2String)
NOTHING_TO_GET(fmi2SetInteger, const fmi2Integer)
NOTHING_TO_GET(fmi2SetBoolean, const fmi2Boolean)
NOTHING_TO_GET(fmi2SetString, const fmi2String)

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state)
        *state = malloc(sizeof(Instance));
    if (!*state)
        return fmi2Error;
    memcpy(*state, c, sizeof(Instance));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Instance));
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Instance);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(Instance))
        return fmi2Error;
    memcpy(bytes, state, sizeof(Instance));
    return fmi2OK;
}

EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    (void)c;
    if (size != sizeof(Instance) || !(*state = malloc(size)))
        return fmi2Error;
    memcpy(*state, bytes, size);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
    const fmi2ValueReference known[], size_t m, const fmi2Real seed[], fmi2Real change[])
{
    (void)c, (void)unknown, (void)n, (void)known, (void)m, (void)seed, (void)change;
    return fmi2Error; /* not provided, as the description says */
}

/* Model exchange. */

EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    memset(info, 0, sizeof *info);
    info->valuesOfContinuousStatesChanged = project(c) > 0.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event, fmi2Boolean *terminate)
{
    Instance copy = *of(c);
    (void)no_return;
    *event = project(&copy) > DRIFT;
    *terminate = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    set_value(c, 0, time);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    if (n != NX)
        return fmi2Error;
    memcpy(of(c)->value + 1, x, sizeof(double) * NX);
    of(c)->current = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rate[], size_t n)
{
    if (n != NX)
        return fmi2Error;
    update_values(c);
    memcpy(rate, of(c)->value + RATES_AT, sizeof(double) * NX);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicator[], size_t n)
{
    (void)c, (void)indicator;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    if (n != NX)
        return fmi2Error;
    memcpy(x, of(c)->value + 1, sizeof(double) * NX);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real size[], size_t n)
{
    (void)c;
    if (n != NX)
        return fmi2Error;
    memcpy(size, state_sizes, sizeof(double) * NX);
    return fmi2OK;
}

/* Co-simulation. */

EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference at[], size_t n,
    const fmi2Integer order[], const fmi2Real value[])
{
    (void)c, (void)at, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2GetRealOutputDerivatives(
    fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], fmi2Real value[])
{
    (void)c, (void)at, (void)order, (void)value;
    return n ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_before)
{
    (void)no_set_before;
    return integrate(c, time + step) ? fmi2Error : fmi2OK;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    (void)c;
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c, (void)kind;
    *value = fmi2OK;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    (void)kind;
    *value = of(c)->value[0];
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    (void)c, (void)kind;
    *value = 0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
