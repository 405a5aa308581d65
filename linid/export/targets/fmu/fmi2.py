"""The C of an FMU of FMI 2.0 around `common.h`; words between two @ are put in by `unit.py`.

Names, types and numbers are those of the interface: FMI 2.0.5, Modelica Association.
"""

FMI2 = """/* @title@
   FMI 2.0 for co-simulation. */

#include "common.h"

#ifdef FMI2_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI2_FUNCTION_PREFIX, fmi2##name)
#else
#define FMI(name) fmi2##name
#endif

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status;
typedef void (*logger)(void *, const char *, status, const char *, const char *, ...);
typedef struct {
    logger log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, status);
    void *environment;
} callbacks;

EXPORTED const char *FMI(GetTypesPlatform)(void) { return "default"; }
EXPORTED const char *FMI(GetVersion)(void) { return "2.0"; }

EXPORTED status FMI(SetDebugLogging)(void *c, int on, size_t count, const char *const categories[])
{
    (void)c; (void)on; (void)count; (void)categories;
    return OK;
}

EXPORTED void *FMI(Instantiate)(const char *name, int type, const char *guid, const char *resources,
                                const callbacks *functions, int visible, int logging)
{
    (void)resources; (void)visible; (void)logging;
    if (type != 1 || !guid || strcmp(guid, "@token@")) {
        if (functions && functions->log)
            functions->log(functions->environment, name, ERROR, "logStatusError",
                           type != 1 ? "is for co-simulation alone" : "has another GUID than its description");
        return 0;
    }
    return created();
}

EXPORTED void FMI(FreeInstance)(void *c) { free(c); }

EXPORTED status FMI(SetupExperiment)(void *c, int has_tolerance, double tolerance, double t, int has_stop, double stop)
{
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    ((instance *)c)->t = t;
    return OK;
}

EXPORTED status FMI(EnterInitializationMode)(void *c) { (void)c; return OK; }

EXPORTED status FMI(ExitInitializationMode)(void *c)
{
    begun(c);
    ((instance *)c)->started = 1;
    return OK;
}

EXPORTED status FMI(Terminate)(void *c) { (void)c; return OK; }
EXPORTED status FMI(Reset)(void *c) { defaults(c); return OK; }

EXPORTED status FMI(GetReal)(void *c, const unsigned int n[], size_t count, double values[])
{
    return get(c, n, count, values) ? OK : ERROR;
}

EXPORTED status FMI(SetReal)(void *c, const unsigned int n[], size_t count, const double values[])
{
    return set(c, n, count, values) ? OK : ERROR;
}

#define NONE_OF(name, type) \\
    EXPORTED status FMI(name)(void *c, const unsigned int n[], size_t count, type values[]) \\
    { \\
        (void)c; (void)n; (void)values; \\
        return count ? ERROR : OK; \\
    }
NONE_OF(GetInteger, int)
NONE_OF(GetBoolean, int)
NONE_OF(GetString, const char *)
NONE_OF(SetInteger, const int)
NONE_OF(SetBoolean, const int)
NONE_OF(SetString, const char *const)

EXPORTED status FMI(GetFMUstate)(void *c, void **state)
{
    if (!*state)
        *state = malloc(sizeof(instance));
    if (!*state)
        return ERROR;
    memcpy(*state, c, sizeof(instance));
    return OK;
}

EXPORTED status FMI(SetFMUstate)(void *c, void *state)
{
    memcpy(c, state, sizeof(instance));
    return OK;
}

EXPORTED status FMI(FreeFMUstate)(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = 0;
    return OK;
}

EXPORTED status FMI(SerializedFMUstateSize)(void *c, void *state, size_t *size)
{
    (void)c; (void)state;
    *size = sizeof(instance);
    return OK;
}

EXPORTED status FMI(SerializeFMUstate)(void *c, void *state, char bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(instance))
        return ERROR;
    memcpy(bytes, state, sizeof(instance));
    return OK;
}

EXPORTED status FMI(DeSerializeFMUstate)(void *c, const char bytes[], size_t size, void **state)
{
    if (size != sizeof(instance) || FMI(GetFMUstate)(c, state) != OK)
        return ERROR;
    memcpy(*state, bytes, sizeof(instance));
    return OK;
}

EXPORTED status FMI(GetDirectionalDerivative)(void *c, const unsigned int u[], size_t nu, const unsigned int k[],
                                              size_t nk, const double dk[], double du[])
{
    (void)c; (void)u; (void)nu; (void)k; (void)nk; (void)dk; (void)du;
    return ERROR;
}

EXPORTED status FMI(SetRealInputDerivatives)(void *c, const unsigned int n[], size_t count, const int order[],
                                             const double values[])
{
    (void)c; (void)n; (void)order; (void)values;
    return count ? ERROR : OK;
}

EXPORTED status FMI(GetRealOutputDerivatives)(void *c, const unsigned int n[], size_t count, const int order[],
                                              double values[])
{
    (void)c; (void)n; (void)order; (void)values;
    return count ? ERROR : OK;
}

EXPORTED status FMI(DoStep)(void *c, double t, double h, int no_way_back)
{
    (void)no_way_back;
    return stepped(c, t, h) ? OK : ERROR;
}

EXPORTED status FMI(CancelStep)(void *c) { (void)c; return ERROR; }

EXPORTED status FMI(GetRealStatus)(void *c, int kind, double *value)
{
    if (kind != 2)
        return DISCARD;
    *value = ((instance *)c)->t;
    return OK;
}

#define NO_STATUS(name, type) \\
    EXPORTED status FMI(name)(void *c, int kind, type *value) \\
    { \\
        (void)c; (void)kind; (void)value; \\
        return DISCARD; \\
    }
NO_STATUS(GetStatus, status)
NO_STATUS(GetIntegerStatus, int)
NO_STATUS(GetBooleanStatus, int)
NO_STATUS(GetStringStatus, const char *)
"""
