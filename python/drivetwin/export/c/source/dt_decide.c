/* SPDX-License-Identifier: MIT */
/* Who stays at rest: the box-constrained programme over all friction elements at zero slip,
 * together with the direction of power through the input gear. */

#include "dt_internal.h"

#define TRIALS 16             /* two clutches, three modes each, and the direction of power */
#define NEGLIGIBLE DT_C(1e-9) /* slip acceleration without meaning, rad/s^2 */

/* What is wrong with a trial. */
typedef enum { NO_FAULT, OVERLOADED, RETURNING, REVERSED } fault_kind;

typedef struct {
    fault_kind kind;
    int row;
    int sign;
} fault;

int dt_at_rest(const dt_mechanism *m, const dt_real *x, int row, dt_real round_off) {
    dt_real scale = DT_C(1);
    for (int i = 0; i < 3; ++i) {
        scale = dt_larger(scale, dt_abs(m->row[row][i] * x[i]));
    }
    return dt_abs(dt_slip(m, row, x)) <= round_off * scale;
}

/* Impulse-like change of the speeds that moves row j by -`slip`, scaled by 1 / `w`. */
static void push(dt_state *s, const dt_mechanism *m, int j, dt_real impulse) {
    for (int i = 0; i < 3; ++i) {
        s->x[i] -= m->share[j][i] * impulse;
        s->carry[i] = DT_C(0);
    }
}

void dt_bring_to_rest(dt_state *s, const dt_mechanism *m, int more) {
    int resting[DT_ROWS];
    for (int j = 0; j < DT_ROWS; ++j) {
        resting[j] = s->mode[j] == DT_STUCK || j == more;
    }
    if (resting[0] && resting[1]) {
        for (int i = 0; i < 2; ++i) { /* two slips at rest leave no speed but zero */
            s->x[i] = s->carry[i] = DT_C(0);
        }
    }
    for (int j = 0; j < DT_ROWS; ++j) {
        if (resting[j]) {
            push(s, m, j, dt_slip(m, j, s->x) / dt_slip(m, j, m->share[j]));
        }
    }
}

void dt_press(dt_state *s, const dt_mechanism *m, int row, int pressed) {
    if (!pressed) {
        s->mode[row] = DT_OPEN;
    } else if (s->mode[row] == DT_OPEN) {
        s->mode[row] = dt_slip(m, row, s->x) < DT_C(0) ? DT_BACKWARD : DT_FORWARD;
    }
}

static dt_real static_capacity(const dt_params *p, const dt_expansion *e, int j) {
    const dt_real normal = dt_larger(e->normal[j][0], DT_C(0));
    if (j == DT_CLUTCHES) {
        return normal;
    }
    return dt_mu_rest(&p->clutch[j].friction) * p->clutch[j].peak * normal;
}

/* The row at rest that exceeds its bounds most, relative to their size. */
static fault worst_overload(const dt_params *p, const dt_expansion *e, const dt_state *trial) {
    fault worst = {NO_FAULT, 0, 0};
    dt_real most = DT_C(0.01) * DT_ROUND_OFF;
    for (int j = 0; j < DT_ROWS; ++j) {
        if (trial->mode[j] != DT_STUCK) {
            continue;
        }
        const dt_real torque = e->torque[j][0];
        const dt_real bound = static_capacity(p, e, j);
        const dt_real size = dt_larger(bound, dt_larger(NEGLIGIBLE * dt_abs(torque), DT_C(1e-12)));
        const dt_real relative = (dt_abs(torque) - bound) / size;
        if (relative > most) {
            most = relative;
            worst.kind = OVERLOADED;
            worst.row = j;
            worst.sign = torque > DT_C(0) ? 1 : -1;
        }
    }
    return worst;
}

/* Sum of the magnitudes of the terms that make up each acceleration: what tells zero from
 * round-off. */
static void acceleration_scale(const dt_mechanism *m, const dt_params *p, const dt_expansion *e,
                               dt_real scale[3]) {
    dt_real f[2] = {dt_abs(m->efficiency * e->engine_torque[0]), dt_abs(e->shaft[0])};
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        f[0] += dt_abs(m->row[j][0] * e->torque[j][0]);
        f[1] += dt_abs(m->row[j][1] * e->torque[j][0]);
    }
    for (int i = 0; i < 2; ++i) {
        scale[i] = dt_abs(m->inverse[i][0]) * f[0] + dt_abs(m->inverse[i][1]) * f[1];
    }
    scale[2] = (dt_abs(p->i_f * e->shaft[0]) + dt_abs(p->load_constant) + p->load_rolling) / p->J_v;
}

static fault find_fault(const dt_mechanism *m, const dt_params *p, const dt_expansion *e,
                        const dt_state *trial, const int candidate[DT_ROWS]) {
    fault found = worst_overload(p, e, trial);
    dt_real scale[3];
    acceleration_scale(m, p, e, scale);
    const dt_real a[3] = {e->x[0][1], e->x[1][1], e->x[2][1]};
    for (int j = 0; j < DT_ROWS && found.kind == NO_FAULT; ++j) {
        const dt_real size = dt_abs(m->row[j][0]) * scale[0] + dt_abs(m->row[j][1]) * scale[1] +
                             m->row[j][2] * scale[2];
        const dt_real away = dt_direction(trial->mode[j]) * dt_slip(m, j, a);
        if (candidate[j] && away < -(DT_ROUND_OFF * size + NEGLIGIBLE)) {
            found.kind = RETURNING;
            found.row = j;
        }
    }
    if (found.kind == NO_FAULT && p->loss_law == DT_DISSIPATIVE) {
        const dt_real size = dt_abs(e->engine_torque[0]) + p->J1 * scale[0];
        const dt_real through = e->through[0];
        if (dt_abs(through) > DT_ROUND_OFF * size && (through < DT_C(0)) != trial->power_backward) {
            found.kind = REVERSED;
        }
    }
    return found;
}

/* State and inputs a moment from now, as the present modes would have them: where torques and
 * capacities agree, or all start from zero, their rates decide. */
static void look_ahead(dt_state *trial, const dt_mechanism *m, const dt_params *p, dt_expansion *e,
                       dt_real remaining) {
    const dt_real moment = dt_smaller(DT_LOOK_AHEAD, DT_C(1e-4) * remaining);
    for (int i = 0; i < DT_STATES; ++i) {
        e->x[i][0] = trial->x[i];
    }
    dt_expand_term(e, m, p, trial, 0);
    for (int i = 0; i < DT_STATES; ++i) {
        trial->x[i] += moment * e->x[i][1];
        e->x[i][0] = trial->x[i];
    }
    e->engine_torque[0] += moment * e->engine_torque[1];
    for (int j = 0; j < DT_ROWS; ++j) {
        e->normal[j][0] += moment * e->normal[j][1];
    }
}

/* Make a trial the state of the run. */
static void adopt(dt_state *s, const dt_state *trial, const int candidate[DT_ROWS]) {
    s->power_backward = trial->power_backward;
    for (int j = 0; j < DT_ROWS; ++j) {
        s->mode[j] = trial->mode[j];
        s->released[j] = candidate[j] && dt_slips(trial->mode[j]);
        if (j < DT_CLUTCHES) {
            s->cell[j] = trial->cell[j];
        }
    }
}

dt_status dt_decide(dt_state *s, const dt_params *p, dt_expansion *e, dt_event overload,
                    dt_real remaining) {
    dt_mechanism m;
    dt_mechanism_of(&m, p, s->power_backward);
    dt_state trial = *s;
    int candidate[DT_ROWS];
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        trial.cell[j] = dt_cell_at(&p->clutch[j].friction, dt_abs(dt_slip(&m, j, s->x)));
    }
    look_ahead(&trial, &m, p, e, remaining);
    for (int j = 0; j < DT_ROWS; ++j) {
        candidate[j] = s->mode[j] == DT_STUCK ||
                       (s->mode[j] != DT_OPEN && dt_at_rest(&m, s->x, j, DT_REST));
        if (candidate[j]) {
            trial.mode[j] = DT_STUCK;
        }
    }
    if (overload.cause == DT_OVERLOAD) {
        trial.mode[overload.row] = overload.sign > 0 ? DT_FORWARD : DT_BACKWARD;
    }
    for (int n = 0; n < TRIALS; ++n) {
        dt_expand_term(e, &m, p, &trial, 0);
        const fault found = find_fault(&m, p, e, &trial, candidate);
        switch (found.kind) {
        case NO_FAULT:
            adopt(s, &trial, candidate);
            return DT_OK;
        case OVERLOADED:
            trial.mode[found.row] = found.sign > 0 ? DT_FORWARD : DT_BACKWARD;
            break;
        case RETURNING:
            trial.mode[found.row] = DT_STUCK;
            break;
        case REVERSED:
            trial.power_backward = !trial.power_backward;
            dt_mechanism_of(&m, p, trial.power_backward);
            break;
        }
    }
    return DT_UNDECIDED;
}
