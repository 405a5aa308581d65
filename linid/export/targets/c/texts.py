"""The C of an exported model around its own functions; words between two @ are put in by `core.py`."""

HEADER = """/* @title@

   @what@. @units@

   A simulation without allocation. Step by step, as a controller or a co-simulation goes:

       @name@_model m;
       @name@_defaults(&m);                 // parameters as identified; change m.p[...] here
       @name@_begin(&m, 0.0, 0.0, 0.0, u);  // t, y, v and the inputs
       @name@_step(&m, u, h);               // inputs from now on, for h seconds
       @name@_outputs(&m, out);             // reading, speed, friction force, thrust

   Or over a whole recording, whose inputs are cubics between the samples: @name@_record. */

#ifndef @NAME@_H
#define @NAME@_H

#define @NAME@_INPUTS @count_inputs@
#define @NAME@_STEP @step@ /* s, that of the identification */
#define @NAME@_SUBSTEPS @substeps@ /* internal steps per sample of the recordings that the model was identified on */
#define @NAME@_TOLERANCE @tolerance@ /* share of friction by which a step may be off */
#define @NAME@_HISTORY @history@ /* steps of which the inputs are remembered */

@enum_p@
@enum_own@
@enum_s@

typedef struct {
    double p[@count_p@];     /* parameters, by P_... */
    double own[@count_own@]; /* parameters of own terms, by OWN_... */
    double s[@count_s@];     /* what a simulation keeps, by S_... */
    double table[@table@];   /* the motor's field: amplitudes, cosines and sines of the windings' steps */
    const double *c;         /* cubics of the inputs: four coefficients each of four inputs, per interval */
@fields@
    double t;                /* s */
    double u[3][3];          /* inputs now, one and two steps before */
    double step;             /* s, internal steps are at most as long */
    long known;              /* steps since the start */
    int order;               /* of the inputs between steps: 0 held, 1 line, 2 parabola through what was given */
    double past[16 * @NAME@_HISTORY];
} @name@_model;

/* Parameters as identified; S_record, S_elapsed (s) and S_added_mass (kg) are 0. */
void @name@_defaults(@name@_model *m);
/* To be called where parameters have changed since the start. */
void @name@_prepare(@name@_model *m);
/* Start at t (s) with the axis at y (m) with v (m/s) under these inputs. */
void @name@_begin(@name@_model *m, double t, double y, double v, const double *u);
/* Go on for h seconds; u: the inputs at the step's begin. Where inputs act late, all steps must be equal. */
void @name@_step(@name@_model *m, const double *u, double h);
/* Reading of the position (m), speed (m/s), friction force and thrust (N), now. */
void @name@_outputs(const @name@_model *m, double out[4]);
/* A whole recording of n samples, dt seconds apart from t on: out holds n rows of four outputs. coefficients: 16 per
   interval; w: the bristle's deflection in m, NAN for what goes with the start; stepping: whether inputs may differ
   before and after a sample. */
void @name@_record(@name@_model *m, const double *coefficients, long n, double t, double dt, long substeps, double y,
                   double v, double w, int stepping, double *out);

#endif
"""

SOURCE = """/* @title@
   Written by linid from the functions of its own simulation; see @name@.h. */

#include "@name@.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef NAN
#define NAN (HUGE_VAL - HUGE_VAL)
#endif

@functions@

void @name@_defaults(@name@_model *m)
{
    memset(m, 0, sizeof *m);
    m->step = @NAME@_STEP;
@defaults@
}

void @name@_prepare(@name@_model *m)
{
    @call_prepare@
}

static void start_at(@name@_model *m, double t, double dt, long substeps, double y, double v, double w)
{
    (void)t; (void)dt; (void)substeps; (void)y; (void)v; (void)w;
    @name@_prepare(m);
    @call_start@
    m->followed = 0;
    m->glide_1 = 1.0;
    m->glide_2 = 0.5;
    m->glide_3 = 1.0 / 6.0;
    m->glide_h = 0.0;
    m->halvings = 0;
    m->steps = 0;
}

static void next_sample(@name@_model *m, double t, double dt, long substeps, long n, int stepping)
{
    @name@_model next;
    (void)t; (void)n; (void)stepping;
    @call_advance@
@copy_next@
}

/* Own terms of friction work in the model's memory. */
static void outputs_at(@name@_model *m, double t, double out[4])
{
    (void)t;
    @call_outputs@
}

void @name@_outputs(const @name@_model *m, double out[4])
{
    @name@_model now = *m;
    outputs_at(&now, now.t, out);
}

void @name@_record(@name@_model *m, const double *coefficients, long n, double t, double dt, long substeps, double y,
                   double v, double w, int stepping, double *out)
{
    long k;
    m->c = coefficients;
    m->s[S_intervals] = (double)(n - 1);
    start_at(m, t, dt, substeps, y, v, w);
    outputs_at(m, t, out);
    for (k = 0; k + 1 < n; k++) {
        next_sample(m, t, dt, substeps, k, stepping);
        m->t = t + (double)k * dt + dt;
        outputs_at(m, m->t, out + 4 * (k + 1));
    }
    m->c = 0;
}

/* The inputs from now on, h seconds: a cubic each, of which the highest power is not used. */
static void remember(@name@_model *m, double h)
{
    double *last = m->past + 16 * (@NAME@_HISTORY - 1);
    int order = m->known < m->order ? (int)m->known : m->order, k;
    memmove(m->past, m->past + 16, sizeof m->past - 16 * sizeof *m->past);
    memset(last, 0, 16 * sizeof *last);
    for (k = 0; k < @NAME@_INPUTS; k++) {
        double now = m->u[0][k], before = m->u[1][k], earlier = m->u[2][k];
        last[4 * k] = now;
        if (order == 1)
            last[4 * k + 1] = (now - before) / h;
        if (order > 1) {
            last[4 * k + 1] = (3.0 * now - 4.0 * before + earlier) / (2.0 * h);
            last[4 * k + 2] = (now - 2.0 * before + earlier) / (2.0 * h * h);
        }
    }
}

void @name@_begin(@name@_model *m, double t, double y, double v, const double *u)
{
    long k;
    memset(m->u, 0, sizeof m->u);
    for (k = 0; k < @NAME@_INPUTS; k++)
        m->u[0][k] = u[k];
    m->known = 0;
    for (k = 0; k < @NAME@_HISTORY; k++)
        remember(m, 1.0);
    m->c = m->past;
    m->s[S_intervals] = @NAME@_HISTORY;
    m->t = t;
    start_at(m, t, m->step, 1, y, v, NAN);
    m->c = 0;
}

void @name@_step(@name@_model *m, const double *u, double h)
{
    long k, substeps = (long)ceil(h / m->step - 1e-9);
    if (m->known > 0) {
        memcpy(m->u[2], m->u[1], sizeof m->u[2]);
        memcpy(m->u[1], m->u[0], sizeof m->u[1]);
    }
    for (k = 0; k < @NAME@_INPUTS; k++)
        m->u[0][k] = u[k];
    remember(m, h);
    m->c = m->past;
    next_sample(m, m->t - (@NAME@_HISTORY - 1) * h, h, substeps < 1 ? 1 : substeps, @NAME@_HISTORY - 1, 1);
    m->c = 0;
    m->t += h;
    m->known++;
}
"""

TEST = """/* Test program of @name@: reads a recording from standard input and writes what the model does.

   Input: n dt t0 substeps stepping y v w record elapsed added_mass, then 16 (n - 1) coefficients of the inputs.
   Output: n lines of reading, speed, friction force and thrust.

       cc -std=c99 -O2 -o @name@_test @name@.c @name@_test.c -lm && ./@name@_test < recording.txt */

#include "@name@.h"

#include <stdio.h>
#include <stdlib.h>

static double number(void)
{
    char text[64];
    if (scanf("%63s", text) != 1) {
        fputs("@name@_test: the input ends early\\n", stderr);
        exit(2);
    }
    return strtod(text, NULL);
}

int main(void)
{
    @name@_model m;
    double head[11], *coefficients, *out;
    long k, n;
    for (k = 0; k < 11; k++)
        head[k] = number();
    n = (long)head[0];
    coefficients = malloc(sizeof *coefficients * 16 * (size_t)(n > 1 ? n - 1 : 1));
    out = malloc(sizeof *out * 4 * (size_t)(n > 0 ? n : 1));
    if (!coefficients || !out || n < 2)
        return 2;
    for (k = 0; k < 16 * (n - 1); k++)
        coefficients[k] = number();
    @name@_defaults(&m);
    m.s[S_record] = head[8];
    m.s[S_elapsed] = head[9];
    m.s[S_added_mass] = head[10];
    @name@_record(&m, coefficients, n, head[2], head[1], (long)head[3], head[5], head[6], head[7], (int)head[4], out);
    for (k = 0; k < n; k++)
        printf("%.17g %.17g %.17g %.17g\\n", out[4 * k], out[4 * k + 1], out[4 * k + 2], out[4 * k + 3]);
    free(coefficients);
    free(out);
    return 0;
}
"""
