/* SPDX-License-Identifier: MIT */
/* mu over |slip|: Stribeck law or table, and its Taylor coefficients in time. */

#include "dt_internal.h"

dt_real dt_mu(const dt_friction *friction, dt_real s) {
    if (friction->points == 0) {
        const dt_real stiction = (friction->mu_s - friction->mu_c) * dt_exp(-s / friction->v_s);
        return friction->mu_c + stiction + friction->mu_v * s;
    }
    const int i = dt_cell_at(friction, s);
    dt_real from, to;
    if (!dt_cell_span(friction, i, &from, &to)) {
        return friction->mu[i];
    }
    return friction->mu[i] + (friction->mu[i + 1] - friction->mu[i]) * (s - from) / (to - from);
}

dt_real dt_mu_rest(const dt_friction *friction) {
    return friction->points == 0 ? friction->mu_s : friction->mu[0];
}

int dt_cell_at(const dt_friction *friction, dt_real s) {
    int i = 0;
    while (i + 1 < friction->points && friction->slip[i + 1] <= s) {
        ++i;
    }
    return i;
}

int dt_cell_span(const dt_friction *friction, int cell, dt_real *from, dt_real *to) {
    const int bounded = cell + 1 < friction->points;
    *from = friction->points == 0 ? DT_C(0) : friction->slip[cell];
    *to = bounded ? friction->slip[cell + 1] : *from;
    return bounded;
}

/* E = exp(-s / v_s) has E' = -(s' / v_s) E, order by order. */
static dt_real exponential_term(const dt_real *size, const dt_real *known, dt_real v_s, int k) {
    dt_real sum = DT_C(0);
    for (int i = 1; i <= k; ++i) {
        sum += DT_C(i) * size[i] * known[k - i];
    }
    return -sum / (v_s * DT_C(k));
}

void dt_mu_term(const dt_friction *friction, int cell, dt_expansion *e, int clutch, int k) {
    const dt_real *size = e->size[clutch];
    dt_real *exponential = e->exponential[clutch];
    dt_real mu;
    if (friction->points == 0) {
        exponential[k] = k == 0 ? dt_exp(-size[0] / friction->v_s)
                                : exponential_term(size, exponential, friction->v_s, k);
        mu = (friction->mu_s - friction->mu_c) * exponential[k] + friction->mu_v * size[k];
        mu += k == 0 ? friction->mu_c : DT_C(0);
    } else {
        dt_real from, to;
        const int bounded = dt_cell_span(friction, cell, &from, &to);
        const dt_real slope =
            bounded ? (friction->mu[cell + 1] - friction->mu[cell]) / (to - from) : DT_C(0);
        mu = k == 0 ? friction->mu[cell] + slope * (size[0] - from) : slope * size[k];
    }
    e->mu[clutch][k] = mu;
}
