/* SPDX-License-Identifier: MIT */
/* Guards: polynomials that stay positive while a mode holds, and the earliest that falls. */

#include "dt_internal.h"

/* Take over an event if its guard falls before the one known so far. */
static void consider(dt_event *best, const dt_real *guard, int order, dt_event event) {
    if (dt_first_fall(guard, order, best->at, &event.at) &&
        (best->cause == DT_NOTHING || event.at < best->at)) {
        *best = event;
    }
}

static dt_event event_of(dt_cause cause, int row, int sign) {
    const dt_event event = {cause, row, sign, DT_C(0)};
    return event;
}

/* What is released at this instant starts from exact zero, and where static and kinetic capacity
 * agree also from zero acceleration: what is left of these is round-off and would look like an
 * immediate return. One that outlasts what a decision looks ahead is a true one. */
static void depart(dt_real *guard, int order, int released) {
    if (!released) {
        return;
    }
    guard[0] = DT_C(0);
    if (order >= 2 &&
        dt_abs(guard[1]) <= DT_C(10) * DT_LOOK_AHEAD * dt_larger(dt_abs(guard[2]), DT_C(1))) {
        guard[1] = DT_C(0);
    }
}

static void slipping_guards(dt_event *best, const dt_expansion *e, const dt_mechanism *m,
                            const dt_params *p, const dt_state *s, int j) {
    const dt_real direction = dt_direction(s->mode[j]);
    dt_series guard;
    for (int k = 0; k <= e->order; ++k) {
        const dt_real speeds[3] = {e->x[0][k], e->x[1][k], e->x[2][k]};
        guard[k] = direction * dt_slip(m, j, speeds);
    }
    const dt_real slip = guard[0];
    depart(guard, e->order, s->released[j]);
    consider(best, guard, e->order, event_of(DT_AT_REST, j, 0));
    if (j == DT_CLUTCHES || p->clutch[j].friction.points == 0) {
        return;
    }
    dt_real from, to;
    const int bounded = dt_cell_span(&p->clutch[j].friction, s->cell[j], &from, &to);
    guard[0] = slip - from;
    if (s->cell[j] > 0) {
        consider(best, guard, e->order, event_of(DT_CELL, j, -1));
    }
    if (bounded) {
        for (int k = 0; k <= e->order; ++k) {
            guard[k] = -guard[k];
        }
        guard[0] = to - slip;
        consider(best, guard, e->order, event_of(DT_CELL, j, 1));
    }
}

/* |torque| <= capacity as two guards: where the capacity goes to zero they fall one after the
 * other. */
static void stuck_guards(dt_event *best, const dt_expansion *e, const dt_params *p, int j) {
    const dt_real rest =
        j == DT_CLUTCHES ? DT_C(1) : p->clutch[j].peak * dt_mu_rest(&p->clutch[j].friction);
    for (int sign = -1; sign <= 1; sign += 2) {
        dt_series guard;
        for (int k = 0; k <= e->order; ++k) {
            guard[k] = (k < 2 ? rest * e->normal[j][k] : DT_C(0)) - DT_C(sign) * e->torque[j][k];
        }
        consider(best, guard, e->order, event_of(DT_OVERLOAD, j, sign));
    }
}

/* Whether what enters the input gear is round-off, whose sign would change at every look: nothing
 * behind the gear takes up torque. */
static int nothing_passes(const dt_expansion *e) {
    int nothing = 1;
    for (int k = 0; k <= e->order; ++k) {
        const dt_real drive = k < 2 ? dt_abs(e->engine_torque[k]) : DT_C(0);
        nothing = nothing && dt_abs(e->through[k]) <= DT_ROUND_OFF * drive;
    }
    return nothing;
}

static void power_guards(dt_event *best, const dt_expansion *e, const dt_state *s) {
    dt_series guard;
    for (int k = 0; k <= e->order; ++k) {
        guard[k] = s->power_backward ? -e->through[k] : e->through[k];
    }
    depart(guard, e->order, s->released[DT_ROWS]);
    if (!nothing_passes(e)) {
        consider(best, guard, e->order, event_of(DT_POWER_REVERSAL, 0, 0));
    }
    consider(best, e->x[DT_ENGINE], e->order, event_of(DT_STALL, 0, 0));
}

static void wheel_guard(dt_event *best, const dt_expansion *e, const dt_state *s) {
    dt_series guard;
    for (int k = 0; k <= e->order; ++k) {
        guard[k] = s->wheel_backward ? -e->x[DT_WHEEL][k] : e->x[DT_WHEEL][k];
    }
    consider(best, guard, e->order, event_of(DT_WHEEL_REVERSAL, 0, 0));
}

dt_event dt_earliest(const dt_expansion *e, const dt_mechanism *m, const dt_params *p,
                     const dt_state *s, dt_real h) {
    dt_event best = {DT_NOTHING, 0, 0, h};
    for (int j = 0; j < DT_ROWS; ++j) {
        if (j < DT_CLUTCHES) {
            const dt_real sign = s->mode[j] == DT_OPEN ? DT_C(-1) : DT_C(1);
            const dt_real guard[2] = {sign * e->normal[j][0], sign * e->normal[j][1]};
            consider(&best, guard, 1, event_of(DT_PRESSED, j, 0));
        }
        if (dt_slips(s->mode[j])) {
            slipping_guards(&best, e, m, p, s, j);
        } else if (s->mode[j] == DT_STUCK) {
            stuck_guards(&best, e, p, j);
        }
    }
    if (p->loss_law == DT_DISSIPATIVE) {
        power_guards(&best, e, s);
    }
    if (p->load_aero > DT_C(0)) {
        wheel_guard(&best, e, s);
    }
    return best;
}
