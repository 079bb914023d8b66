/* SPDX-License-Identifier: MIT */
/* One step of fixed length: expand, find the first event, advance, change the mode. */

#include "dt_internal.h"

static dt_inputs between(const dt_inputs *from, const dt_inputs *rate, dt_real t) {
    dt_inputs at;
    at.engine_torque = from->engine_torque + rate->engine_torque * t;
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        at.pressure[j] = from->pressure[j] + rate->pressure[j] * t;
    }
    return at;
}

static dt_inputs rate_of(const dt_inputs *from, const dt_inputs *to, dt_real h) {
    dt_inputs rate;
    rate.engine_torque = (to->engine_torque - from->engine_torque) / h;
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        rate.pressure[j] = (to->pressure[j] - from->pressure[j]) / h;
    }
    return rate;
}

static int differ(dt_real a, dt_real b) { return a < b || a > b; }

/* Whether inputs are not those that the last step ended with. */
static int has_jumped(const dt_state *s, const dt_inputs *now) {
    int jumped = differ(s->inputs.engine_torque, now->engine_torque);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        jumped = jumped || differ(s->inputs.pressure[j], now->pressure[j]);
    }
    return jumped;
}

/* Forget what was decided by other parameters, but for locks that are at rest by these as well. */
static void let_go(dt_state *s, const dt_params *p) {
    dt_mechanism m;
    dt_mechanism_of(&m, p, 0);
    s->power_backward = 0;
    s->wheel_backward = s->x[DT_WHEEL] < DT_C(0);
    for (int j = 0; j < DT_ROWS; ++j) {
        if (s->mode[j] != DT_STUCK || !dt_at_rest(&m, s->x, j, DT_ROUND_OFF)) {
            s->mode[j] = DT_OPEN;
        }
    }
}

/* Take up everything that follows the inputs anew at this instant. */
static dt_status refresh(dt_state *s, const dt_params *p, dt_expansion *e, dt_real remaining) {
    const dt_event none = {DT_NOTHING, 0, 0, DT_C(0)};
    dt_mechanism m;
    dt_mechanism_of(&m, p, s->power_backward);
    for (int j = 0; j < DT_ROWS; ++j) {
        const dt_real now = e->normal[j][0];
        dt_press(s, &m, j, now > DT_C(0) || (!(now < DT_C(0)) && e->normal[j][1] > DT_C(0)));
    }
    dt_bring_to_rest(s, &m, -1);
    return dt_decide(s, p, e, none, remaining);
}

/* Whether the normal load is gone within round-off of the time: what is left of the capacity is
 * then no larger than what is left of the torque. */
static int is_about_to_vent(const dt_expansion *e, int row) {
    return e->normal[row][0] <= -e->normal[row][1] * DT_C(0.1) * DT_ROUND_OFF;
}

/* Carry out what an event caused. */
static dt_status change_mode(dt_state *s, const dt_params *p, dt_expansion *e, dt_event event,
                             dt_real remaining) {
    const int backward = s->power_backward;
    dt_mechanism m;
    dt_mechanism_of(&m, p, s->power_backward);
    switch (event.cause) {
    case DT_AT_REST:
        dt_bring_to_rest(s, &m, event.row);
        break;
    case DT_PRESSED:
        dt_press(s, &m, event.row, s->mode[event.row] == DT_OPEN);
        break;
    case DT_OVERLOAD:
        if (is_about_to_vent(e, event.row)) {
            dt_press(s, &m, event.row, 0);
            event.cause = DT_PRESSED;
        } else {
            dt_bring_to_rest(s, &m, -1);
        }
        break;
    case DT_POWER_REVERSAL:
        s->power_backward = !s->power_backward;
        break;
    case DT_CELL:
        s->cell[event.row] += event.sign;
        return DT_OK;
    case DT_WHEEL_REVERSAL:
        s->wheel_backward = !s->wheel_backward;
        return DT_OK;
    case DT_STALL:
        return DT_ENGINE_STALLED;
    case DT_NOTHING:
        return DT_OK;
    }
    const dt_status status = dt_decide(s, p, e, event, remaining);
    if (event.cause == DT_POWER_REVERSAL) { /* unless decided otherwise */
        s->released[DT_ROWS] = s->power_backward != backward;
    }
    return status;
}

/* Whether the engine stands still or turns backward, where the dissipative law would need the
 * direction of motion of the gear and its friction at rest. It may start from rest. */
static int has_stalled(const dt_state *s, const dt_params *p, const dt_expansion *e) {
    const dt_real speed = s->x[DT_ENGINE];
    return p->loss_law == DT_DISSIPATIVE &&
           (speed < DT_C(0) || (!(speed > DT_C(0)) && !(e->x[DT_ENGINE][1] > DT_C(0))));
}

/* State at t after the start of the expansion, without losing what rounding cuts off. */
static int advance(dt_state *s, const dt_expansion *e, dt_real t) {
    int finite = 1;
    for (int i = 0; i < DT_STATES; ++i) {
        const dt_real change = t * dt_value(&e->x[i][1], e->order - 1, t) + s->carry[i];
        const dt_real next = s->x[i] + change;
        s->carry[i] = change - (next - s->x[i]);
        s->x[i] = next;
        finite = finite && dt_is_finite(next);
    }
    for (int j = 0; j < DT_GUARDS; ++j) {
        s->released[j] = s->released[j] && !(t > DT_C(0));
    }
    return finite;
}

static void fill_outputs(dt_outputs *out, const dt_state *s, const dt_params *p,
                         const dt_expansion *e, dt_real t) {
    dt_mechanism m;
    dt_mechanism_of(&m, p, s->power_backward);
    out->engine_speed = s->x[DT_ENGINE];
    out->output_speed = s->x[DT_OUTPUT];
    out->wheel_speed = s->x[DT_WHEEL];
    out->twist = s->x[DT_TWIST];
    out->output_torque = p->k_o * s->x[DT_TWIST] +
                         p->c_o * (s->x[DT_OUTPUT] - p->i_f * s->x[DT_WHEEL]);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        out->clutch_torque[j] = dt_value(e->torque[j], e->order, t);
        out->slip[j] = s->mode[j] == DT_STUCK ? DT_C(0) : dt_slip(&m, j, s->x);
        out->mode[j] = s->mode[j];
    }
}

static int outputs_are_finite(const dt_outputs *out) {
    int finite = dt_is_finite(out->engine_speed) && dt_is_finite(out->output_speed) &&
                 dt_is_finite(out->wheel_speed) && dt_is_finite(out->twist) &&
                 dt_is_finite(out->output_torque);
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        finite = finite && dt_is_finite(out->clutch_torque[j]) && dt_is_finite(out->slip[j]);
    }
    return finite;
}

/* Bring a clutch to zero slip by the impulse of its torque, of which the input gear loses its part
 * as of any torque: an impulse that accelerates the engine comes through it from behind. */
static void lock(dt_state *s, const dt_params *p, int row) {
    const dt_state before = *s;
    dt_mechanism m;
    dt_mechanism_of(&m, p, 0);
    dt_bring_to_rest(s, &m, row);
    if (p->loss_law == DT_DISSIPATIVE && s->x[DT_ENGINE] > before.x[DT_ENGINE]) {
        *s = before;
        dt_mechanism_of(&m, p, 1);
        dt_bring_to_rest(s, &m, row);
    }
}

/* Hand over what a call came to where it is sound. */
static dt_status finish(dt_status status, dt_state *state, const dt_state *next,
                        dt_outputs *outputs, const dt_outputs *found) {
    if (status == DT_OK && !outputs_are_finite(found)) {
        return DT_BAD_STATE;
    }
    if (status == DT_OK) {
        *state = *next;
        *outputs = *found;
    }
    return status;
}

static dt_status begin(dt_state *state, const dt_params *params, const dt_start *start,
                       const dt_inputs *inputs, dt_outputs *outputs) {
    const dt_state blank = {{0}, {0}, {DT_OPEN}, {0}, {0}, 0, 0, {0, {0}}, 0};
    const dt_inputs still = {0, {0}};
    dt_expansion e;
    dt_mechanism m;
    if (dt_check(params) != 0) {
        return DT_BAD_PARAMETER;
    }
    *state = blank;
    state->x[DT_ENGINE] = start->engine_speed;
    state->x[DT_OUTPUT] = start->output_speed;
    state->x[DT_WHEEL] = start->wheel_speed;
    state->x[DT_TWIST] = start->twist;
    int sound = dt_inputs_in_range(inputs) && start->locked >= 0 && start->locked <= DT_CLUTCHES;
    for (int i = 0; i < DT_STATES; ++i) {
        sound = sound && dt_is_finite(state->x[i]);
    }
    if (!sound) {
        return DT_BAD_STATE;
    }
    let_go(state, params);
    state->inputs = *inputs;
    state->params = dt_mark(params);
    lock(state, params, start->locked - 1);
    dt_set_inputs(&e, params, inputs, &still);
    const dt_status status = refresh(state, params, &e, DT_C(1));
    if (status != DT_OK) {
        return status;
    }
    dt_set_inputs(&e, params, inputs, &still);
    dt_mechanism_of(&m, params, state->power_backward);
    (void)dt_expand(&e, &m, params, state, DT_C(0));
    if (has_stalled(state, params, &e)) {
        return DT_ENGINE_STALLED;
    }
    fill_outputs(outputs, state, params, &e, DT_C(0));
    outputs->pieces = 0;
    return DT_OK;
}

dt_status dt_begin(dt_state *state, const dt_params *params, const dt_start *start,
                   const dt_inputs *inputs, dt_outputs *outputs) {
    dt_state next;
    dt_outputs found;
    const dt_status status = begin(&next, params, start, inputs, &found);
    return finish(status, state, &next, outputs, &found);
}

static dt_status step(dt_state *state, const dt_params *params, const dt_inputs *from,
                      const dt_inputs *to, dt_real h, dt_outputs *outputs) {
    if (!(h > DT_C(0)) || !dt_is_finite(h) || !dt_inputs_in_range(from) ||
        !dt_inputs_in_range(to)) {
        return DT_BAD_STATE;
    }
    const dt_inputs rate = rate_of(from, to, h);
    const uint64_t mark = dt_mark(params);
    const int changed = mark != state->params;
    const int jumped = changed || has_jumped(state, from);
    if (changed && dt_check(params) != 0) {
        return DT_BAD_PARAMETER;
    }
    dt_event event = {DT_NOTHING, 0, 0, DT_C(0)};
    dt_real t = DT_C(0);
    dt_expansion e;
    dt_mechanism m;
    dt_status status = DT_OK;
    if (changed) {
        let_go(state, params);
    }
    for (int n = 1; n <= DT_PIECES && status == DT_OK; ++n) {
        const dt_inputs at = between(from, &rate, t);
        const dt_real remaining = h - t;
        dt_set_inputs(&e, params, &at, &rate);
        status = n == 1 && jumped ? refresh(state, params, &e, remaining)
                                  : change_mode(state, params, &e, event, remaining);
        if (status != DT_OK) {
            return status;
        }
        state->params = mark;
        dt_set_inputs(&e, params, &at, &rate); /* a decision looks ahead and moves them on */
        dt_mechanism_of(&m, params, state->power_backward);
        const dt_real length = dt_expand(&e, &m, params, state, remaining);
        if (has_stalled(state, params, &e)) {
            return DT_ENGINE_STALLED;
        }
        event = dt_earliest(&e, &m, params, state, length);
        status = advance(state, &e, event.at) ? DT_OK : DT_BAD_STATE;
        t += event.at;
        fill_outputs(outputs, state, params, &e, event.at);
        outputs->pieces = n;
        if (event.cause == DT_NOTHING && length >= remaining) {
            state->inputs = *to;
            return status;
        }
    }
    return status == DT_OK ? DT_TOO_MANY_EVENTS : status;
}

dt_status dt_step(dt_state *state, const dt_params *params, const dt_inputs *from,
                  const dt_inputs *to, dt_real h, dt_outputs *outputs) {
    dt_state next = *state;
    dt_outputs found;
    const dt_status status = step(&next, params, from, to, h, &found);
    return finish(status, state, &next, outputs, &found);
}
