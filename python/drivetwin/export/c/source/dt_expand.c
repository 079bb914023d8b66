/* SPDX-License-Identifier: MIT */
/* Taylor expansion in time of the whole motion in one friction mode. */

#include "dt_internal.h"

dt_real dt_value(const dt_real *c, int order, dt_real t) {
    dt_real value = c[order];
    for (int k = order - 1; k >= 0; --k) {
        value = value * t + c[k];
    }
    return value;
}

void dt_mechanism_of(dt_mechanism *m, const dt_params *p, int power_backward) {
    m->efficiency = power_backward ? DT_C(1) / p->eta : p->eta;
    dt_real engine = p->J1 * m->efficiency + p->J2e;
    dt_real output = p->J_out;
    dt_real coupling = DT_C(0);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        const dt_clutch *clutch = &p->clutch[j];
        const dt_real alpha = DT_C(1) / (p->i_in * clutch->i_c);
        m->row[j][0] = alpha;
        m->row[j][1] = -clutch->i_out;
        m->row[j][2] = DT_C(0);
        engine += clutch->drum_inertia * alpha * alpha;
        output += clutch->drum_inertia * clutch->i_out * clutch->i_out;
        coupling -= clutch->drum_inertia * alpha * clutch->i_out;
    }
    const dt_real determinant = engine * output - coupling * coupling;
    m->inverse[0][0] = output / determinant;
    m->inverse[0][1] = -coupling / determinant;
    m->inverse[1][0] = m->inverse[0][1];
    m->inverse[1][1] = engine / determinant;
    m->row[DT_CLUTCHES][0] = m->row[DT_CLUTCHES][1] = DT_C(0);
    m->row[DT_CLUTCHES][2] = DT_C(1);
    for (int j = 0; j < DT_ROWS; ++j) {
        for (int i = 0; i < 2; ++i) {
            m->share[j][i] = m->inverse[i][0] * m->row[j][0] + m->inverse[i][1] * m->row[j][1];
        }
        m->share[j][2] = m->row[j][2] / p->J_v;
    }
}

void dt_set_inputs(dt_expansion *e, const dt_params *p, const dt_inputs *at,
                   const dt_inputs *rate) {
    e->engine_torque[0] = at->engine_torque;
    e->engine_torque[1] = rate->engine_torque;
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        e->normal[j][0] = p->clutch[j].gain * (at->pressure[j] - p->clutch[j].P0);
        e->normal[j][1] = p->clutch[j].gain * rate->pressure[j];
    }
    e->normal[DT_CLUTCHES][0] = p->load_rolling;
    e->normal[DT_CLUTCHES][1] = DT_C(0);
}

static void slipping_torques(dt_expansion *e, const dt_mechanism *m, const dt_params *p,
                             const dt_state *s, int k) {
    for (int j = 0; j < DT_ROWS; ++j) {
        const dt_real direction = dt_direction(s->mode[j]);
        e->torque[j][k] = DT_C(0);
        if (!dt_slips(s->mode[j])) {
            continue;
        }
        if (j == DT_CLUTCHES) {
            e->torque[j][k] = k == 0 ? direction * e->normal[j][0] : DT_C(0);
            continue;
        }
        e->size[j][k] =
            direction * (m->row[j][0] * e->x[DT_ENGINE][k] + m->row[j][1] * e->x[DT_OUTPUT][k]);
        dt_mu_term(&p->clutch[j].friction, s->cell[j], e, j, k);
        dt_real torque = e->mu[j][k] * e->normal[j][0];
        torque += k > 0 ? e->mu[j][k - 1] * e->normal[j][1] : DT_C(0);
        e->torque[j][k] = direction * torque;
    }
}

/* Forces of everything but the rows at rest. */
static void forces(dt_expansion *e, const dt_mechanism *m, const dt_params *p, const dt_state *s,
                   int k, dt_real f[3]) {
    const dt_real drive = k < 2 ? e->engine_torque[k] : DT_C(0);
    e->shaft[k] = p->k_o * e->x[DT_TWIST][k] +
                  p->c_o * (e->x[DT_OUTPUT][k] - p->i_f * e->x[DT_WHEEL][k]);
    f[0] = m->efficiency * drive;
    f[1] = -e->shaft[k];
    f[2] = p->i_f * e->shaft[k] - (k == 0 ? p->load_constant : DT_C(0));
    dt_real square = DT_C(0);
    for (int i = 0; i <= k; ++i) {
        square += e->x[DT_WHEEL][i] * e->x[DT_WHEEL][k - i];
    }
    f[2] -= (s->wheel_backward ? -p->load_aero : p->load_aero) * square;
    for (int j = 0; j < DT_ROWS; ++j) {
        for (int i = 0; i < 3; ++i) {
            f[i] -= m->row[j][i] * e->torque[j][k];
        }
    }
}

static void hold(const dt_mechanism *m, int j, dt_real torque, dt_real a[3]) {
    for (int i = 0; i < 3; ++i) {
        a[i] -= m->share[j][i] * torque;
    }
}

/* Torques that keep the slip of the rows at rest, and the accelerations with them. */
static void holding_torques(dt_expansion *e, const dt_mechanism *m, const dt_state *s, int k,
                            dt_real a[3]) {
    if (s->mode[DT_CLUTCHES] == DT_STUCK) {
        e->torque[DT_CLUTCHES][k] = a[2] / m->share[DT_CLUTCHES][2];
        a[2] = DT_C(0);
    }
    const dt_real need[2] = {dt_slip(m, 0, a), dt_slip(m, 1, a)};
    const dt_real w00 = dt_slip(m, 0, m->share[0]);
    const dt_real w01 = dt_slip(m, 0, m->share[1]);
    const dt_real w11 = dt_slip(m, 1, m->share[1]);
    if (s->mode[0] == DT_STUCK && s->mode[1] == DT_STUCK) {
        const dt_real determinant = w00 * w11 - w01 * w01;
        e->torque[0][k] = (need[0] * w11 - need[1] * w01) / determinant;
        e->torque[1][k] = (need[1] * w00 - need[0] * w01) / determinant;
        a[0] = a[1] = DT_C(0); /* two slips at rest leave no speed but zero */
    } else if (s->mode[0] == DT_STUCK) {
        e->torque[0][k] = need[0] / w00;
        hold(m, 0, e->torque[0][k], a);
    } else if (s->mode[1] == DT_STUCK) {
        e->torque[1][k] = need[1] / w11;
        hold(m, 1, e->torque[1][k], a);
    }
}

void dt_expand_term(dt_expansion *e, const dt_mechanism *m, const dt_params *p, const dt_state *s,
                    int k) {
    dt_real f[3];
    slipping_torques(e, m, p, s, k);
    forces(e, m, p, s, k, f);
    dt_real a[3] = {m->inverse[0][0] * f[0] + m->inverse[0][1] * f[1],
                    m->inverse[1][0] * f[0] + m->inverse[1][1] * f[1], f[2] / p->J_v};
    holding_torques(e, m, s, k, a);
    e->through[k] = (k < 2 ? e->engine_torque[k] : DT_C(0)) - p->J1 * a[0];
    if (k + 1 == DT_TERMS) {
        return;
    }
    const dt_real next = DT_C(k + 1);
    for (int i = 0; i < 3; ++i) {
        e->x[i][k + 1] = a[i] / next;
    }
    e->x[DT_TWIST][k + 1] = (e->x[DT_OUTPUT][k] - p->i_f * e->x[DT_WHEEL][k]) / next;
}

/* Largest coefficient k relative to its state: speeds to 1 rad/s, twist to 1 mrad at least. */
static dt_real relative_size(const dt_expansion *e, int k) {
    dt_real size = DT_C(0);
    for (int i = 0; i < DT_STATES; ++i) {
        const dt_real floor = i == DT_TWIST ? DT_C(1e-3) : DT_C(1);
        size = dt_larger(size, dt_abs(e->x[i][k]) / dt_larger(dt_abs(e->x[i][0]), floor));
    }
    return size;
}

/* The part of `h` over which the terms of stiction up to `order` bound those after it.
 * With q the swing of |slip| / v_s they are as q^k / k! times exp(-|slip| / v_s) at the start: where
 * that is tiny they may start below any tolerance and still rise, up to k = q. Only a swing at whose
 * end nothing is left of stiction may be larger. */
static dt_real bounded_span(const dt_expansion *e, const dt_params *p, const dt_state *s, int order,
                         dt_real h) {
    dt_real part = DT_C(1);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        const dt_friction *friction = &p->clutch[j].friction;
        const int decays = dt_abs(friction->mu_s - friction->mu_c) > DT_C(0);
        if (friction->points > 0 || !decays || !dt_slips(s->mode[j])) {
            continue;
        }
        dt_real swing = DT_C(0);
        for (int k = order; k >= 1; --k) {
            swing = (swing + dt_abs(e->size[j][k])) * h;
        }
        swing /= friction->v_s;
        const dt_real most =
            dt_larger(DT_C(0.5) * DT_C(order), e->size[j][0] / friction->v_s - DT_FADED);
        part = swing > most ? dt_smaller(part, most / swing) : part;
    }
    return h * part;
}

dt_real dt_expand(dt_expansion *e, const dt_mechanism *m, const dt_params *p, const dt_state *s,
                  dt_real h) {
    /* Two successive terms must be small: every other one of an even or odd motion is zero. */
    dt_real before = DT_C(1), recent = DT_C(1), power = DT_C(1);
    for (int i = 0; i < DT_STATES; ++i) {
        e->x[i][0] = s->x[i];
    }
    e->order = DT_TERMS - 1;
    for (int k = 0; k < DT_TERMS - 1; ++k) {
        dt_expand_term(e, m, p, s, k);
        power *= h;
        before = recent;
        recent = relative_size(e, k + 1) * power;
        if (dt_larger(before, recent) <= DT_TOLERANCE && bounded_span(e, p, s, k, h) >= h) {
            e->order = k + 1;
            break;
        }
    }
    dt_expand_term(e, m, p, s, e->order);
    const dt_real excess = dt_larger(before, recent) / DT_TOLERANCE;
    if (excess > DT_C(1)) {
        h *= dt_smaller(DT_C(0.8) * dt_pow(excess, DT_C(-1) / DT_C(DT_TERMS - 1)), DT_C(1));
    }
    return bounded_span(e, p, s, e->order, h);
}
