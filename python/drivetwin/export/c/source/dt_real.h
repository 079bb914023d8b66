/* SPDX-License-Identifier: MIT */
/** @file dt_real.h
 *  The number type of the model, chosen here alone: double, or float with -DDT_FLOAT.
 */
#ifndef DT_REAL_H
#define DT_REAL_H

#include <float.h>
#include <math.h>
#include <stdint.h>

#ifdef DT_FLOAT

typedef float dt_real;
typedef uint32_t dt_bits; /* as wide */
#define DT_EPSILON FLT_EPSILON
#define DT_TERMS 10          /* Taylor coefficients of a piece */
#define DT_TOLERANCE 1e-7F   /* truncation error of a piece, relative to the state */
#define DT_REST 5e-7F        /* slip that counts as zero, relative to the speeds behind it */
#define DT_ROUND_OFF 2e-5F   /* what counts as zero in a sum, relative to its terms */
#define DT_LOOK_AHEAD 1e-6F  /* how far ahead a decision looks, s */
#define DT_FADED 24.0F       /* slip over v_s at which nothing is left of stiction */
#define dt_exp(x) expf(x)
#define dt_pow(x, y) powf(x, y)
#define dt_sqrt(x) sqrtf(x)
#define dt_abs(x) fabsf(x)

#else

typedef double dt_real;
typedef uint64_t dt_bits;
#define DT_EPSILON DBL_EPSILON
#define DT_TERMS 15
#define DT_TOLERANCE 1e-12
#define DT_REST 1e-11
#define DT_ROUND_OFF 1e-10
#define DT_LOOK_AHEAD 1e-10
#define DT_FADED 35.0
#define dt_exp(x) exp(x)
#define dt_pow(x, y) pow(x, y)
#define dt_sqrt(x) sqrt(x)
#define dt_abs(x) fabs(x)

#endif

/** A constant or an integer as dt_real. */
#define DT_C(x) ((dt_real)(x))

static inline dt_real dt_larger(dt_real a, dt_real b) { return a > b ? a : b; }
static inline dt_real dt_smaller(dt_real a, dt_real b) { return a < b ? a : b; }
/** False for infinities and NaN; needs no macro that some headers implement by casts. */
static inline int dt_is_finite(dt_real a) { return a - a >= DT_C(0); }
static inline dt_real dt_square(dt_real a) { return a * a; }

#endif
