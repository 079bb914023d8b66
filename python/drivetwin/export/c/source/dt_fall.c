/* SPDX-License-Identifier: MIT */
/* The first instant at which a guard polynomial falls below zero. The search rests on bounds of the
 * polynomial, not on samples, so that excursions inside the step are found too. */

#include "dt_internal.h"

#define SEARCHES 60 /* intervals tried; beyond, a root up to the end counts as at the last one */
#define NEWTON 60   /* a bracket of doubles halves so often at most */

static dt_real slope_at(const dt_real *c, int order, dt_real t) {
    dt_real value = DT_C(0);
    for (int k = order; k >= 1; --k) {
        value = value * t + DT_C(k) * c[k];
    }
    return value;
}

/* Root of a polynomial that falls through zero once in the bracket: Newton kept inside it. */
static dt_real bracketed_root(const dt_real *c, int order, dt_real from, dt_real to) {
    dt_real t = DT_C(0.5) * (from + to);
    for (int i = 0; i < NEWTON; ++i) {
        const dt_real value = dt_value(c, order, t);
        const dt_real slope = slope_at(c, order, t);
        if (value > DT_C(0)) {
            from = t;
        } else {
            to = t;
        }
        const dt_real newton = slope < DT_C(0) ? t - value / slope : from;
        const dt_real next = newton > from && newton < to ? newton : DT_C(0.5) * (from + to);
        if (!(value > DT_C(0)) && !(value < DT_C(0))) {
            return t;
        }
        if (dt_abs(next - t) <= DT_EPSILON * DT_C(0.5) * t || to - from <= DT_EPSILON * to) {
            return next;
        }
        t = next;
    }
    return t;
}

/* How far the polynomial can swing about its value in the middle of an interval, and whether it
 * falls throughout. */
static dt_real swing_about(const dt_real *c, int order, dt_real middle, dt_real radius,
                           dt_real *value, int *falls) {
    dt_series d;
    dt_real swing = DT_C(0), bend = DT_C(0);
    for (int k = 0; k <= order; ++k) {
        d[k] = c[k];
    }
    for (int i = 0; i < order; ++i) {
        for (int k = order - 1; k >= i; --k) {
            d[k] += middle * d[k + 1];
        }
    }
    for (int k = order; k >= 1; --k) {
        swing = (swing + dt_abs(d[k])) * radius;
        if (k > 1) {
            bend = bend * radius + DT_C(k) * dt_abs(d[k]);
        }
    }
    *value = d[0];
    *falls = order >= 1 && -d[1] > bend * radius;
    return swing;
}

/* First root in [0, h] of a polynomial that is positive at 0. */
static int search(const dt_real *c, int order, dt_real h, dt_real *at) {
    dt_real from = DT_C(0), width = h;
    for (int n = 0; n < SEARCHES; ++n) {
        const dt_real to = dt_smaller(from + width, h);
        const dt_real radius = DT_C(0.5) * (to - from);
        const dt_real middle = from + radius;
        dt_real value;
        int falls;
        const dt_real swing = swing_about(c, order, middle, radius, &value, &falls);
        const int clear = value > swing;
        const int narrow = radius <= DT_C(2) * DT_EPSILON * h || middle <= from || middle >= to;
        if (!clear && !falls && !narrow) {
            width = radius;
            continue;
        }
        if (!clear && dt_value(c, order, to) < DT_C(0)) {
            *at = falls ? bracketed_root(c, order, from, to) : from;
            return 1;
        }
        from = to;
        width = DT_C(2) * width;
        if (from >= h) {
            return 0;
        }
    }
    *at = from;
    return dt_value(c, order, h) < DT_C(0);
}

int dt_first_fall(const dt_real *c, int order, dt_real h, dt_real *at) {
    dt_real reach = DT_C(0), power = DT_C(1);
    for (int k = 1; k <= order; ++k) {
        power *= h;
        reach += dt_abs(c[k]) * power;
    }
    if (c[0] > reach) {
        return 0;
    }
    const dt_real negligible = DT_C(512) * DT_EPSILON * (dt_abs(c[0]) + reach);
    if (c[0] > negligible) {
        return search(c, order, h, at);
    }
    /* A guard that starts at zero and rises is left alone until it falls again: so starts what has
     * just changed its mode. */
    int leading = 1;
    power = h;
    while (leading <= order && dt_abs(c[leading]) * power <= negligible) {
        ++leading;
        power *= h;
    }
    if (leading > order) {
        return 0;
    }
    if (c[leading] < DT_C(0)) {
        *at = DT_C(0);
        return 1;
    }
    return search(c + leading, order - leading, h, at);
}
