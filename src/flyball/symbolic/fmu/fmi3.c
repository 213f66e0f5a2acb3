/* FMI 3.0.2: model exchange and co-simulation. Declarations follow the standard's headers fmi3PlatformTypes.h,
   fmi3FunctionTypes.h and fmi3Functions.h. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi3Instance;
typedef void *fmi3FMUState;
typedef uint32_t VR; /* value reference */
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;

static Instance *of(fmi3Instance c)
{
    return c;
}

static fmi3Instance made(fmi3String token)
{
    if (!token || strcmp(token, TOKEN))
        return NULL;
    Instance *s = malloc(sizeof *s);
    if (s)
        reset_instance(s);
    return s;
}

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, bool on, size_t n, const fmi3String names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return fmi3OK;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging, void *environment, void *log)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    return made(token);
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, bool visible,
    bool logging, bool events, bool early, const VR required[], size_t n, void *environment, void *log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)required, (void)n;
    (void)environment, (void)log, (void)update;
    return made(token);
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
    bool visible, bool logging, void *environment, void *log, void *clock, void *lock, void *unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    (void)clock, (void)lock, (void)unlock;
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance c)
{
    free(c);
}

EXPORT fmi3Status fmi3EnterInitializationMode(
    fmi3Instance c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    (void)has_stop, (void)stop;
    if (has_tolerance && tolerance > 0.0)
        of(c)->tolerance = tolerance;
    set_value(c, 0, start);
    of(c)->initializing = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    project(c);
    of(c)->initializing = 0;
    return fmi3OK;
}

#define NO_EFFECT(name)                                                                                      \
    EXPORT fmi3Status name(fmi3Instance c)                                                                   \
    {                                                                                                        \
        (void)c;                                                                                             \
        return fmi3OK;                                                                                       \
    }
NO_EFFECT(fmi3EnterEventMode)
NO_EFFECT(fmi3Terminate)
NO_EFFECT(fmi3EnterContinuousTimeMode)
NO_EFFECT(fmi3EnterStepMode)
NO_EFFECT(fmi3EnterConfigurationMode)
NO_EFFECT(fmi3ExitConfigurationMode)
NO_EFFECT(fmi3EvaluateDiscreteStates)

EXPORT fmi3Status fmi3Reset(fmi3Instance c)
{
    reset_instance(c);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const VR at[], size_t n, double value[], size_t m)
{
    if (n != m)
        return fmi3Error;
    update_values(c);
    for (size_t k = 0; k < n; k++) {
        if (at[k] >= VALUES)
            return fmi3Error;
        value[k] = of(c)->value[at[k]];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const VR at[], size_t n, const double value[], size_t m)
{
    if (n != m)
        return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (!may_be_set(c, at[k]))
            return fmi3Error;
        set_value(c, at[k], value[k]);
    }
    return fmi3OK;
}

#define NO_VALUES(type, name)                                                                                \
    EXPORT fmi3Status fmi3Get##name(fmi3Instance c, const VR at[], size_t n, type value[], size_t m)         \
    {                                                                                                        \
        (void)c, (void)at, (void)value, (void)m;                                                             \
        return n ? fmi3Error : fmi3OK;                                                                       \
    }                                                                                                        \
    EXPORT fmi3Status fmi3Set##name(fmi3Instance c, const VR at[], size_t n, const type value[], size_t m)   \
    {                                                                                                        \
        (void)c, (void)at, (void)value, (void)m;                                                             \
        return n ? fmi3Error : fmi3OK;                                                                       \
    }
NO_VALUES(float, Float32)
NO_VALUES(int8_t, Int8)
NO_VALUES(uint8_t, UInt8)
NO_VALUES(int16_t, Int16)
NO_VALUES(uint16_t, UInt16)
NO_VALUES(int32_t, Int32)
NO_VALUES(uint32_t, UInt32)
NO_VALUES(int64_t, Int64)
NO_VALUES(uint64_t, UInt64)
NO_VALUES(bool, Boolean)
NO_VALUES(fmi3String, String)

EXPORT fmi3Status fmi3GetBinary(
    fmi3Instance c, const VR at[], size_t n, size_t sizes[], fmi3Binary value[], size_t m)
{
    (void)c, (void)at, (void)sizes, (void)value, (void)m;
    return n ? fmi3Error : fmi3OK;
}

EXPORT fmi3Status fmi3SetBinary(
    fmi3Instance c, const VR at[], size_t n, const size_t sizes[], const fmi3Binary value[], size_t m)
{
    (void)c, (void)at, (void)sizes, (void)value, (void)m;
    return n ? fmi3Error : fmi3OK;
}

#define NO_CLOCKS(name, ...)                                                                                 \
    EXPORT fmi3Status name(fmi3Instance c, const VR at[], size_t n, __VA_ARGS__)                             \
    {                                                                                                        \
        (void)c, (void)at;                                                                                   \
        return n ? fmi3Error : fmi3OK;                                                                       \
    }
NO_CLOCKS(fmi3GetClock, bool *a)
NO_CLOCKS(fmi3SetClock, const bool *a)
NO_CLOCKS(fmi3GetIntervalDecimal, double *a, int *b)
NO_CLOCKS(fmi3GetIntervalFraction, uint64_t *a, uint64_t *b, int *d)
NO_CLOCKS(fmi3GetShiftDecimal, double *a)
NO_CLOCKS(fmi3GetShiftFraction, uint64_t *a, uint64_t *b)
NO_CLOCKS(fmi3SetIntervalDecimal, const double *a)
NO_CLOCKS(fmi3SetIntervalFraction, const uint64_t *a, const uint64_t *b)
NO_CLOCKS(fmi3SetShiftDecimal, const double *a)
NO_CLOCKS(fmi3SetShiftFraction, const uint64_t *a, const uint64_t *b)
NO_CLOCKS(fmi3GetOutputDerivatives, const int32_t *a, double *b, size_t d)

EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance c, VR clock, double time)
{
    (void)c, (void)clock, (void)time;
    return fmi3Error;
}

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, VR at, size_t *n)
{
    (void)c, (void)at, (void)n;
    return fmi3Error; /* not provided, as the description says */
}

EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance c, VR at, size_t a[], VR b[], size_t d[], int e[], size_t n)
{
    (void)c, (void)at, (void)a, (void)b, (void)d, (void)e, (void)n;
    return fmi3Error;
}

EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const VR unknown[], size_t n, const VR known[], size_t m,
    const double seed[], size_t ns, double change[], size_t nc)
{
    (void)c, (void)unknown, (void)n, (void)known, (void)m, (void)seed, (void)ns, (void)change, (void)nc;
    return fmi3Error;
}

EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const VR unknown[], size_t n, const VR known[], size_t m,
    const double seed[], size_t ns, double change[], size_t nc)
{
    return fmi3GetDirectionalDerivative(c, unknown, n, known, m, seed, ns, change, nc);
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    if (!*state)
        *state = malloc(sizeof(Instance));
    if (!*state)
        return fmi3Error;
    memcpy(*state, c, sizeof(Instance));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    memcpy(c, state, sizeof(Instance));
    return fmi3OK;
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Instance);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(Instance))
        return fmi3Error;
    memcpy(bytes, state, sizeof(Instance));
    return fmi3OK;
}

EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    (void)c;
    if (size != sizeof(Instance) || !(*state = malloc(size)))
        return fmi3Error;
    memcpy(*state, bytes, size);
    return fmi3OK;
}

/* Model exchange. */

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, bool *again, bool *terminate, bool *nominals, bool *values,
    bool *has_next, double *next)
{
    (void)next;
    *again = *terminate = *nominals = *has_next = false;
    *values = project(c) > 0.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, bool no_return, bool *event, bool *terminate)
{
    Instance copy = *of(c);
    (void)no_return;
    *event = project(&copy) > DRIFT;
    *terminate = false;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, double time)
{
    set_value(c, 0, time);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const double x[], size_t n)
{
    if (n != NX)
        return fmi3Error;
    memcpy(of(c)->value + 1, x, sizeof(double) * NX);
    of(c)->current = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, double rate[], size_t n)
{
    if (n != NX)
        return fmi3Error;
    update_values(c);
    memcpy(rate, of(c)->value + RATES_AT, sizeof(double) * NX);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance c, double indicator[], size_t n)
{
    (void)c, (void)indicator;
    return n ? fmi3Error : fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, double x[], size_t n)
{
    if (n != NX)
        return fmi3Error;
    memcpy(x, of(c)->value + 1, sizeof(double) * NX);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, double size[], size_t n)
{
    (void)c;
    if (n != NX)
        return fmi3Error;
    memcpy(size, state_sizes, sizeof(double) * NX);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    (void)c;
    *n = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    (void)c;
    *n = NX;
    return fmi3OK;
}

/* Co-simulation. */

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, double time, double step, bool no_set_before, bool *event, bool *terminate,
    bool *early, double *last)
{
    (void)no_set_before;
    *event = *terminate = *early = false;
    const int failed = integrate(c, time + step);
    *last = of(c)->value[0];
    return failed ? fmi3Error : fmi3OK;
}
