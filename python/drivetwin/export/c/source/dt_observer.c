/* SPDX-License-Identifier: MIT */
/* Extended Kalman filter for torques, friction and load. */

#include "dt_observer.h"

#include "dt_internal.h"

#define N DT_OBSERVED
#define MOVING 4             /* states with a law of motion; the others drift */
#define NO_SLIP DT_C(0.02)   /* slip of a locked clutch that counts as measured, rad/s */
#define CLEAR DT_C(3)        /* slip that is clear, over that of a locked clutch */
#define FIRST_SCALE DT_C(0.3) /* what is not known of friction and load at first */
#define FIRST_LOAD DT_C(0.3)
#define LEAST_SCALE DT_C(0.2) /* friction below which no lining falls: torques of other origin */

/* Clutch torques and accelerations as linear forms over the state, with what the inputs add. */
typedef struct {
    dt_real torque[DT_CLUTCHES][N];
    dt_real held[DT_CLUTCHES]; /* what the inputs add to the torque of a locked clutch */
    dt_real A[MOVING][N];
    dt_real b[MOVING];
    dt_real drive[2]; /* accelerations per unit of engine torque */
} law_of_motion;

dt_tuning dt_usual_tuning(void) {
    const dt_tuning usual = {DT_C(0.1), DT_C(0.05), DT_C(20), DT_C(0.3), DT_C(2000), DT_C(1)};
    return usual;
}

static dt_real normal_of(const dt_params *p, const dt_inputs *u, int j) {
    return dt_larger(p->clutch[j].gain * (u->pressure[j] - p->clutch[j].P0), DT_C(0));
}

/* Torques of clutches that do not hold. */
static void set_torques(law_of_motion *law, const dt_mechanism *m, const dt_params *p,
                        const dt_observer *o, const dt_inputs *u) {
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        const dt_real slip = dt_slip(m, j, o->x);
        const dt_real capacity = dt_mu(&p->clutch[j].friction, dt_abs(slip)) * normal_of(p, u, j);
        for (int i = 0; i < N; ++i) {
            law->torque[j][i] = DT_C(0);
        }
        law->torque[j][DT_SCALE + j] = slip < DT_C(0) ? -capacity : capacity;
        law->held[j] = DT_C(0);
    }
}

/* Take the torque out of one column of accelerations that keeps the slip of clutch j. */
static dt_real hold(const dt_mechanism *m, int j, dt_real *engine, dt_real *output) {
    const dt_real weight = dt_slip(m, j, m->share[j]);
    const dt_real torque = (m->row[j][0] * *engine + m->row[j][1] * *output) / weight;
    *engine -= m->share[j][0] * torque;
    *output -= m->share[j][1] * torque;
    return torque;
}

static void set_law(law_of_motion *law, const dt_mechanism *m, const dt_params *p,
                    const dt_observer *o, const dt_inputs *u, int locked) {
    dt_real shaft[N] = {0};
    set_torques(law, m, p, o, u);
    shaft[DT_OUTPUT] = p->c_o;
    shaft[DT_WHEEL] = -p->c_o * p->i_f;
    shaft[DT_TWIST] = p->k_o;
    for (int i = 0; i < N; ++i) {
        dt_real engine = DT_C(0), output = -shaft[i];
        for (int j = 0; j < DT_CLUTCHES; ++j) {
            if (j != locked) {
                engine -= m->row[j][0] * law->torque[j][i];
                output -= m->row[j][1] * law->torque[j][i];
            }
        }
        law->A[DT_ENGINE][i] = m->inverse[0][0] * engine + m->inverse[0][1] * output;
        law->A[DT_OUTPUT][i] = m->inverse[1][0] * engine + m->inverse[1][1] * output;
        law->A[DT_WHEEL][i] = p->i_f * shaft[i] / p->J_v;
        law->A[DT_TWIST][i] = DT_C(0);
        if (locked >= 0) {
            law->torque[locked][i] = hold(m, locked, &law->A[DT_ENGINE][i], &law->A[DT_OUTPUT][i]);
        }
    }
    law->A[DT_WHEEL][DT_LOAD] = DT_C(-1) / p->J_v;
    law->A[DT_TWIST][DT_OUTPUT] = DT_C(1);
    law->A[DT_TWIST][DT_WHEEL] = -p->i_f;
    law->drive[0] = m->inverse[0][0] * m->efficiency;
    law->drive[1] = m->inverse[1][0] * m->efficiency;
    if (locked >= 0) {
        law->held[locked] = u->engine_torque * hold(m, locked, &law->drive[0], &law->drive[1]);
    }
    const dt_real wheel = o->x[DT_WHEEL];
    const dt_real drag = p->load_aero * wheel * dt_abs(wheel) +
                         (wheel < DT_C(0) ? -p->load_rolling : p->load_rolling);
    law->b[DT_ENGINE] = law->drive[0] * u->engine_torque;
    law->b[DT_OUTPUT] = law->drive[1] * u->engine_torque;
    law->b[DT_WHEEL] = -drag / p->J_v;
    law->b[DT_TWIST] = DT_C(0);
}

static dt_real torque_of(const law_of_motion *law, const dt_observer *o, int j) {
    dt_real torque = law->held[j];
    for (int i = 0; i < N; ++i) {
        torque += law->torque[j][i] * o->x[i];
    }
    return torque;
}

/* Whether the capacity of a clutch, as far as its friction is known, may carry what holds it. */
static int may_hold(const dt_observer *o, const dt_mechanism *m, const dt_params *p,
                    const dt_inputs *u, int j) {
    law_of_motion law;
    const int scale = DT_SCALE + j;
    const dt_real most = o->x[scale] + DT_C(2) * dt_sqrt(dt_larger(o->P[scale][scale], DT_C(0)));
    const dt_real friction = p->clutch[j].peak * dt_mu_rest(&p->clutch[j].friction);
    set_law(&law, m, p, o, u, j);
    return most * friction * normal_of(p, u, j) > dt_abs(torque_of(&law, o, j));
}

/* The pressed clutch whose measured slip is small and whose capacity may suffice, -1: none. A
 * locked one stays so for longer. */
static int locked_clutch(const dt_observer *o, const dt_mechanism *m, const dt_params *p,
                         const dt_tuning *tuning, const dt_measured *now) {
    const dt_real speeds[3] = {now->engine_speed, now->output_speed, DT_C(0)};
    int locked = -1;
    dt_real smallest = DT_C(0);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        const dt_real slip = dt_abs(dt_slip(m, j, speeds));
        const dt_real bound = tuning->locked_slip * (j == o->locked ? DT_C(2) : DT_C(1));
        if (slip < bound && (locked < 0 || slip < smallest) &&
            may_hold(o, m, p, &now->inputs, j)) {
            locked = j;
            smallest = slip;
        }
    }
    return locked;
}

/* Transition of the moving states over h, F = I + A h (I + A h/2 (I + A h/3)), and what the inputs
 * add to them; the terms left out are below 1e-3 of a 60 Hz motion at 1 ms. */
static void transition(const law_of_motion *law, dt_real h, dt_real F[MOVING][N],
                       dt_real added[MOVING]) {
    for (int i = 0; i < MOVING; ++i) {
        added[i] = DT_C(0);
        for (int j = 0; j < N; ++j) {
            F[i][j] = i == j ? DT_C(1) : DT_C(0);
        }
    }
    for (int order = 3; order >= 1; --order) {
        const dt_real step = h / DT_C(order);
        dt_real next[MOVING][N], sum[MOVING];
        for (int i = 0; i < MOVING; ++i) {
            sum[i] = law->b[i] * step;
            for (int k = 0; k < MOVING; ++k) {
                sum[i] += step * law->A[i][k] * added[k];
            }
            for (int j = 0; j < N; ++j) {
                dt_real value = j >= MOVING ? law->A[i][j] : DT_C(0);
                for (int k = 0; k < MOVING; ++k) {
                    value += law->A[i][k] * F[k][j];
                }
                next[i][j] = (i == j ? DT_C(1) : DT_C(0)) + step * value;
            }
        }
        for (int i = 0; i < MOVING; ++i) {
            added[i] = sum[i];
            for (int j = 0; j < N; ++j) {
                F[i][j] = next[i][j];
            }
        }
    }
}

static void predict(dt_observer *o, const dt_mechanism *m, const dt_params *p,
                    const dt_tuning *tuning, const dt_inputs *u, dt_real h) {
    law_of_motion law;
    dt_real F[MOVING][N], added[MOVING], moved[MOVING][N], x[MOVING];
    set_law(&law, m, p, o, u, o->locked);
    transition(&law, h, F, added);
    for (int i = 0; i < MOVING; ++i) {
        x[i] = added[i];
        for (int j = 0; j < N; ++j) {
            x[i] += F[i][j] * o->x[j];
            moved[i][j] = DT_C(0);
            for (int k = 0; k < N; ++k) {
                moved[i][j] += F[i][k] * o->P[k][j];
            }
        }
    }
    for (int i = 0; i < MOVING; ++i) {
        o->x[i] = x[i];
        for (int j = 0; j < N; ++j) {
            dt_real value = moved[i][j];
            if (j < MOVING) {
                value = DT_C(0);
                for (int k = 0; k < N; ++k) {
                    value += moved[i][k] * F[j][k];
                }
            }
            o->P[i][j] = o->P[j][i] = value;
        }
    }
    for (int i = 0; i < 2; ++i) { /* white over 10 ms */
        for (int j = 0; j < 2; ++j) {
            o->P[i][j] += dt_square(tuning->engine_torque) * law.drive[i] * law.drive[j] *
                          DT_C(0.01) * h;
        }
    }
    o->P[DT_LOAD][DT_LOAD] += dt_square(tuning->load) * h;
    if (o->learning >= 0) {
        o->P[DT_SCALE + o->learning][DT_SCALE + o->learning] += dt_square(tuning->scale) * h;
    }
}

/* The clutch that slips clearly while no other is pressed, -1: none. Friction is learnt from it
 * alone: where a lock or break-away comes a moment before it is seen, or a second clutch carries
 * torque, friction would have to explain what it does not cause. */
static int learning_clutch(const dt_mechanism *m, const dt_params *p, const dt_tuning *tuning,
                           const dt_measured *now) {
    const dt_real speeds[3] = {now->engine_speed, now->output_speed, DT_C(0)};
    int learning = -1, pressed = 0;
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        if (normal_of(p, &now->inputs, j) > DT_C(0)) {
            ++pressed;
            learning = dt_abs(dt_slip(m, j, speeds)) > CLEAR * tuning->locked_slip ? j : -1;
        }
    }
    return pressed == 1 ? learning : -1;
}

/* Take in one measured value of row * speeds, in the form that keeps the covariance positive for
 * any gain. */
static void correct(dt_observer *o, const dt_real row[2], dt_real value, dt_real std) {
    dt_real PH[N], gain[N];
    dt_real variance = dt_square(std), seen = DT_C(0);
    for (int i = 0; i < N; ++i) {
        PH[i] = o->P[i][0] * row[0] + o->P[i][1] * row[1];
    }
    variance += row[0] * PH[0] + row[1] * PH[1];
    seen = row[0] * o->x[0] + row[1] * o->x[1];
    for (int i = 0; i < N; ++i) {
        const int is_scale = i >= DT_SCALE && i < DT_SCALE + DT_CLUTCHES;
        gain[i] = is_scale && i != DT_SCALE + o->learning ? DT_C(0) : PH[i] / variance;
        o->x[i] += gain[i] * (value - seen);
    }
    for (int i = 0; i < N; ++i) {
        for (int j = 0; j <= i; ++j) {
            o->P[i][j] -= gain[i] * PH[j] + PH[i] * gain[j] - gain[i] * variance * gain[j];
            o->P[j][i] = o->P[i][j];
        }
    }
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        o->x[DT_SCALE + j] = dt_larger(o->x[DT_SCALE + j], LEAST_SCALE);
    }
}

static void fill_estimates(dt_estimates *out, const dt_observer *o, const dt_mechanism *m,
                           const dt_params *p, const dt_inputs *u) {
    law_of_motion law;
    dt_real shaft[MOVING] = {DT_C(0), p->c_o, -p->c_o * p->i_f, p->k_o};
    dt_real variance = DT_C(0);
    set_law(&law, m, p, o, u, o->locked);
    out->output_torque = DT_C(0);
    for (int i = 0; i < MOVING; ++i) {
        out->output_torque += shaft[i] * o->x[i];
        for (int j = 0; j < MOVING; ++j) {
            variance += shaft[i] * o->P[i][j] * shaft[j];
        }
    }
    out->output_torque_std = dt_sqrt(dt_larger(variance, DT_C(0)));
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        out->clutch_torque[j] = torque_of(&law, o, j);
        out->scale[j] = o->x[DT_SCALE + j];
        out->scale_std[j] = dt_sqrt(dt_larger(o->P[DT_SCALE + j][DT_SCALE + j], DT_C(0)));
        out->slip[j] = dt_slip(m, j, o->x);
    }
    out->load = o->x[DT_LOAD];
    out->load_std = dt_sqrt(dt_larger(o->P[DT_LOAD][DT_LOAD], DT_C(0)));
    out->locked = o->locked;
}

void dt_observer_begin(dt_observer *observer, const dt_params *params, const dt_measured *now) {
    const dt_real load = params->load_constant;
    const dt_real uncertain = dt_larger(dt_abs(load), DT_C(1)) * FIRST_LOAD;
    const dt_real x[N] = {now->engine_speed,
                          now->output_speed,
                          now->output_speed / params->i_f,
                          load / params->i_f / params->k_o,
                          DT_C(1),
                          DT_C(1),
                          load};
    const dt_real std[N] = {DT_C(1),
                            DT_C(1),
                            DT_C(0.1),
                            uncertain / params->i_f / params->k_o + DT_C(1e-3),
                            FIRST_SCALE,
                            FIRST_SCALE,
                            uncertain};
    for (int i = 0; i < N; ++i) {
        observer->x[i] = x[i];
        for (int j = 0; j < N; ++j) {
            observer->P[i][j] = i == j ? dt_square(std[i]) : DT_C(0);
        }
    }
    observer->locked = observer->learning = -1;
}

void dt_observer_resume(dt_observer *observer, const dt_params *params, const dt_measured *now) {
    const dt_observer before = *observer;
    dt_observer_begin(observer, params, now);
    for (int i = DT_SCALE; i < N; ++i) {
        observer->x[i] = before.x[i];
        for (int j = DT_SCALE; j < N; ++j) {
            observer->P[i][j] = before.P[i][j];
        }
    }
}

static int is_finite(const dt_observer *o) {
    int finite = 1;
    for (int i = 0; i < N; ++i) {
        finite = finite && dt_is_finite(o->x[i]);
        for (int j = 0; j < N; ++j) {
            finite = finite && dt_is_finite(o->P[i][j]);
        }
    }
    return finite;
}

/* The other estimates are parts of the observer's own state. */
static int estimates_are_finite(const dt_estimates *out) {
    int finite = dt_is_finite(out->output_torque) && dt_is_finite(out->output_torque_std);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        finite = finite && dt_is_finite(out->clutch_torque[j]) && dt_is_finite(out->slip[j]);
    }
    return finite;
}

dt_status dt_observe(dt_observer *observer, const dt_params *params, const dt_tuning *tuning,
                     const dt_measured *now, dt_real h, dt_estimates *estimates) {
    const dt_real limit = DT_C(DT_OBSERVER_SUBSTEP) * DT_C(DT_OBSERVER_SUBSTEPS);
    const int sound = dt_abs(now->engine_speed) <= DT_C(DT_MOST_SPEED) &&
                      dt_abs(now->output_speed) <= DT_C(DT_MOST_SPEED) &&
                      dt_inputs_in_range(&now->inputs);
    if (!sound || !(h > DT_C(0)) || h > limit) {
        return DT_BAD_STATE;
    }
    const dt_observer before = *observer;
    dt_mechanism m;
    dt_mechanism_of(&m, params,
                    params->loss_law == DT_DISSIPATIVE && now->inputs.engine_torque < DT_C(0));
    observer->locked = locked_clutch(observer, &m, params, tuning, now);
    observer->learning = learning_clutch(&m, params, tuning, now);
    const dt_real most = DT_C(1.001) * DT_C(DT_OBSERVER_SUBSTEP); /* 10 ms are ten, not eleven */
    int parts = 1;
    while (parts < DT_OBSERVER_SUBSTEPS && h > most * DT_C(parts)) {
        ++parts;
    }
    for (int i = 0; i < parts; ++i) {
        predict(observer, &m, params, tuning, &now->inputs, h / DT_C(parts));
    }
    const dt_real engine[2] = {DT_C(1), DT_C(0)}, output[2] = {DT_C(0), DT_C(1)};
    correct(observer, engine, now->engine_speed, tuning->engine_speed);
    correct(observer, output, now->output_speed, tuning->output_speed);
    if (observer->locked >= 0) {
        correct(observer, m.row[observer->locked], DT_C(0), NO_SLIP);
    }
    dt_estimates found;
    fill_estimates(&found, observer, &m, params, &now->inputs);
    if (!is_finite(observer) || !estimates_are_finite(&found)) {
        *observer = before;
        return DT_BAD_STATE;
    }
    *estimates = found;
    return DT_OK;
}
