"""The C of an FMU of FMI 3.0 around `common.h`; words between two @ are put in by `unit.py`.

Names, types and numbers are those of the interface: FMI 3.0.2, Modelica Association.
"""

FMI3 = """/* @title@
   FMI 3.0 for co-simulation. */

#include "common.h"

#include <stdbool.h>

#ifdef FMI3_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI3_FUNCTION_PREFIX, fmi3##name)
#else
#define FMI(name) fmi3##name
#endif

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status;
typedef void (*logger)(void *, status, const char *, const char *);

EXPORTED const char *FMI(GetVersion)(void) { return "3.0"; }

EXPORTED status FMI(SetDebugLogging)(void *c, bool on, size_t count, const char *const categories[])
{
    (void)c; (void)on; (void)count; (void)categories;
    return OK;
}

EXPORTED void *FMI(InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible,
                                            bool logging, bool events, bool early, const uint32_t wanted[],
                                            size_t count, void *environment, logger log, void *update)
{
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early; (void)wanted; (void)count;
    (void)update;
    if (!token || strcmp(token, "@token@")) {
        if (log)
            log(environment, ERROR, "logStatusError", "has another instantiation token than its description");
        return 0;
    }
    return created();
}

EXPORTED void *FMI(InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible,
                                             bool logging, void *environment, logger log)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)environment; (void)log;
    return 0;
}

EXPORTED void *FMI(InstantiateScheduledExecution)(const char *name, const char *token, const char *resources,
                                                  bool visible, bool logging, void *environment, logger log,
                                                  void *clock, void *lock, void *unlock)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)environment; (void)log; (void)clock;
    (void)lock; (void)unlock;
    return 0;
}

EXPORTED void FMI(FreeInstance)(void *c) { free(c); }

EXPORTED status FMI(EnterInitializationMode)(void *c, bool has_tolerance, double tolerance, double t, bool has_stop,
                                             double stop)
{
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    ((instance *)c)->t = t;
    return OK;
}

EXPORTED status FMI(ExitInitializationMode)(void *c)
{
    begun(c);
    ((instance *)c)->started = 1;
    return OK;
}

EXPORTED status FMI(Terminate)(void *c) { (void)c; return OK; }
EXPORTED status FMI(Reset)(void *c) { defaults(c); return OK; }

EXPORTED status FMI(GetFloat64)(void *c, const uint32_t n[], size_t count, double values[], size_t size)
{
    return size == count && get(c, n, count, values) ? OK : ERROR;
}

EXPORTED status FMI(SetFloat64)(void *c, const uint32_t n[], size_t count, const double values[], size_t size)
{
    return size == count && set(c, n, count, values) ? OK : ERROR;
}

#define NONE_OF(name, type) \\
    EXPORTED status FMI(name)(void *c, const uint32_t n[], size_t count, type values[], size_t size) \\
    { \\
        (void)c; (void)n; (void)values; (void)size; \\
        return count ? ERROR : OK; \\
    }
#define NONE_BOTH(name, type) NONE_OF(Get##name, type) NONE_OF(Set##name, const type)
NONE_BOTH(Float32, float)
NONE_BOTH(Int8, int8_t)
NONE_BOTH(UInt8, uint8_t)
NONE_BOTH(Int16, int16_t)
NONE_BOTH(UInt16, uint16_t)
NONE_BOTH(Int32, int32_t)
NONE_BOTH(UInt32, uint32_t)
NONE_BOTH(Int64, int64_t)
NONE_BOTH(UInt64, uint64_t)
NONE_BOTH(Boolean, bool)
NONE_OF(GetString, const char *)
NONE_OF(SetString, const char *const)

EXPORTED status FMI(GetBinary)(void *c, const uint32_t n[], size_t count, size_t sizes[], const uint8_t *values[],
                               size_t size)
{
    (void)c; (void)n; (void)sizes; (void)values; (void)size;
    return count ? ERROR : OK;
}

EXPORTED status FMI(SetBinary)(void *c, const uint32_t n[], size_t count, const size_t sizes[],
                               const uint8_t *const values[], size_t size)
{
    (void)c; (void)n; (void)sizes; (void)values; (void)size;
    return count ? ERROR : OK;
}

EXPORTED status FMI(GetFMUState)(void *c, void **state)
{
    if (!*state)
        *state = malloc(sizeof(instance));
    if (!*state)
        return ERROR;
    memcpy(*state, c, sizeof(instance));
    return OK;
}

EXPORTED status FMI(SetFMUState)(void *c, void *state)
{
    memcpy(c, state, sizeof(instance));
    return OK;
}

EXPORTED status FMI(FreeFMUState)(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = 0;
    return OK;
}

EXPORTED status FMI(SerializedFMUStateSize)(void *c, void *state, size_t *size)
{
    (void)c; (void)state;
    *size = sizeof(instance);
    return OK;
}

EXPORTED status FMI(SerializeFMUState)(void *c, void *state, uint8_t bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(instance))
        return ERROR;
    memcpy(bytes, state, sizeof(instance));
    return OK;
}

EXPORTED status FMI(DeserializeFMUState)(void *c, const uint8_t bytes[], size_t size, void **state)
{
    if (size != sizeof(instance) || FMI(GetFMUState)(c, state) != OK)
        return ERROR;
    memcpy(*state, bytes, sizeof(instance));
    return OK;
}

EXPORTED status FMI(DoStep)(void *c, double t, double h, bool no_way_back, bool *events, bool *ended, bool *early,
                            double *reached)
{
    (void)no_way_back;
    *events = *ended = *early = false;
    *reached = t;
    if (!stepped(c, t, h))
        return ERROR;
    *reached = t + h;
    return OK;
}

EXPORTED status FMI(GetOutputDerivatives)(void *c, const uint32_t n[], size_t count, const int32_t orders[],
                                          double values[], size_t size)
{
    (void)c; (void)n; (void)orders; (void)values; (void)size;
    return count ? ERROR : OK;
}

/* What no description of this unit promises. */
#define NEVER(name, arguments) \\
    EXPORTED status FMI(name) arguments { return ERROR; }
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
NEVER(EnterEventMode, (void *c))
NEVER(EnterConfigurationMode, (void *c))
NEVER(ExitConfigurationMode, (void *c))
NEVER(EnterStepMode, (void *c))
NEVER(EvaluateDiscreteStates, (void *c))
NEVER(UpdateDiscreteStates, (void *c, bool *a, bool *b, bool *d, bool *e, bool *f, double *g))
NEVER(GetClock, (void *c, const uint32_t n[], size_t count, bool values[]))
NEVER(SetClock, (void *c, const uint32_t n[], size_t count, const bool values[]))
NEVER(GetNumberOfVariableDependencies, (void *c, uint32_t n, size_t *count))
NEVER(GetVariableDependencies, (void *c, uint32_t n, size_t a[], uint32_t b[], size_t d[], int e[], size_t count))
NEVER(GetDirectionalDerivative, (void *c, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk,
                                 const double seed[], size_t ns, double out[], size_t no))
NEVER(GetAdjointDerivative, (void *c, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk,
                             const double seed[], size_t ns, double out[], size_t no))
NEVER(GetIntervalDecimal, (void *c, const uint32_t n[], size_t count, double a[], int b[]))
NEVER(GetIntervalFraction, (void *c, const uint32_t n[], size_t count, uint64_t a[], uint64_t b[], int d[]))
NEVER(GetShiftDecimal, (void *c, const uint32_t n[], size_t count, double a[]))
NEVER(GetShiftFraction, (void *c, const uint32_t n[], size_t count, uint64_t a[], uint64_t b[]))
NEVER(SetIntervalDecimal, (void *c, const uint32_t n[], size_t count, const double a[]))
NEVER(SetIntervalFraction, (void *c, const uint32_t n[], size_t count, const uint64_t a[], const uint64_t b[]))
NEVER(SetShiftDecimal, (void *c, const uint32_t n[], size_t count, const double a[]))
NEVER(SetShiftFraction, (void *c, const uint32_t n[], size_t count, const uint64_t a[], const uint64_t b[]))
NEVER(EnterContinuousTimeMode, (void *c))
NEVER(CompletedIntegratorStep, (void *c, bool a, bool *b, bool *d))
NEVER(SetTime, (void *c, double t))
NEVER(SetContinuousStates, (void *c, const double x[], size_t count))
NEVER(GetContinuousStateDerivatives, (void *c, double x[], size_t count))
NEVER(GetEventIndicators, (void *c, double x[], size_t count))
NEVER(GetContinuousStates, (void *c, double x[], size_t count))
NEVER(GetNominalsOfContinuousStates, (void *c, double x[], size_t count))
NEVER(GetNumberOfEventIndicators, (void *c, size_t *count))
NEVER(GetNumberOfContinuousStates, (void *c, size_t *count))
NEVER(ActivateModelPartition, (void *c, uint32_t n, double t))
"""
