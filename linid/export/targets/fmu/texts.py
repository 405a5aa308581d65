"""The C that units of both versions share; words between two @ are put in by `unit.py`."""

COMMON = """/* What the FMUs of @name@ of both versions share: variables by value reference, and steps. */

#include "@name@.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

enum {
    V_TIME,
    V_INPUT,
    V_OUTPUT = V_INPUT + @NAME@_INPUTS,
    V_START_POSITION = V_OUTPUT + 4,
    V_START_SPEED,
    V_RECORD,
    V_ELAPSED,
    V_ADDED_MASS,
    V_STEP,
    V_ORDER,
    V_P,
    V_OWN = V_P + @count_p@,
    V_END = V_OWN + @true_own@
};

typedef struct {
    @name@_model m;
    double t, u[3], out[4], start_position, start_speed, order;
    int started, known; /* whether the simulation runs, and whether out is what is seen of it now */
} instance;

static void defaults(instance *one)
{
    memset(one, 0, sizeof *one);
    @name@_defaults(&one->m);
    one->order = @order@;
}

static instance *created(void)
{
    instance *one = malloc(sizeof *one);
    if (one)
        defaults(one);
    return one;
}

/* Begin the simulation, with what has been set until now. */
static void begun(instance *one)
{
    one->m.order = one->order < 0.5 ? 0 : one->order < 1.5 ? 1 : 2;
    @name@_begin(&one->m, one->t, one->start_position, one->start_speed, one->u);
    one->known = 0;
}

/* Where a variable stands; a null pointer where there is none of that number. */
static double *variable(instance *one, unsigned int number)
{
    if (number == V_TIME)
        return &one->t;
    if (number < V_OUTPUT)
        return &one->u[number - V_INPUT];
    if (number < V_START_POSITION)
        return &one->out[number - V_OUTPUT];
    switch (number) {
    case V_START_POSITION:
        return &one->start_position;
    case V_START_SPEED:
        return &one->start_speed;
    case V_RECORD:
        return &one->m.s[S_record];
    case V_ELAPSED:
        return &one->m.s[S_elapsed];
    case V_ADDED_MASS:
        return &one->m.s[S_added_mass];
    case V_STEP:
        return &one->m.step;
    case V_ORDER:
        return &one->order;
    default:
        break;
    }
    if (number < V_OWN)
        return &one->m.p[number - V_P];
    return number < V_END ? &one->m.own[number - V_OWN] : 0;
}

static int get(instance *one, const unsigned int *numbers, size_t count, double *values)
{
    size_t k;
    for (k = 0; k < count; k++) {
        double *place = variable(one, numbers[k]);
        if (!place)
            return 0;
        if (numbers[k] >= V_OUTPUT && numbers[k] < V_START_POSITION && !one->known) {
            if (!one->started)
                begun(one);
            @name@_outputs(&one->m, one->out);
            one->known = 1;
        }
        values[k] = *place;
    }
    return 1;
}

static int set(instance *one, const unsigned int *numbers, size_t count, const double *values)
{
    size_t k;
    int parameters = 0;
    for (k = 0; k < count; k++) {
        double *place = variable(one, numbers[k]);
        if (!place || numbers[k] == V_TIME || (numbers[k] >= V_OUTPUT && numbers[k] < V_START_POSITION))
            return 0;
        *place = values[k];
        parameters |= numbers[k] >= V_P;
    }
    if (parameters && one->started)
        @name@_prepare(&one->m);
    if (parameters || !one->started)
        one->known = 0;
    return 1;
}

static int stepped(instance *one, double t, double h)
{
    if (!(h > 0.0) || !one->started)
        return 0;
    one->m.t = t;
    @name@_step(&one->m, one->u, h);
    one->t = t + h;
    one->known = 0;
    return fabs(one->m.y) < 1e6 && fabs(one->m.v) < 1e4; /* m and m/s; beyond, it has diverged */
}
"""
