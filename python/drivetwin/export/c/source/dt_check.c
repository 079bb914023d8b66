/* SPDX-License-Identifier: MIT */
/* The ranges of parameters and inputs, and what tells one set of them from another. */

#include "dt_internal.h"

static int at_least(dt_real value, dt_real least) { return value >= least && dt_is_finite(value); }

static int more_than(dt_real value, dt_real least) { return value > least && dt_is_finite(value); }

static int not_zero(dt_real value) { return dt_is_finite(value) && dt_abs(value) > DT_C(0); }

static const char *check_friction(const dt_friction *law) {
    if (law->points < 0 || law->points > DT_POINTS) {
        return "friction.points";
    }
    if (law->points == 0) {
        return !at_least(law->mu_c, 0)  ? "friction.mu_c"
               : !at_least(law->mu_s, 0) ? "friction.mu_s"
               : !more_than(law->v_s, 0) ? "friction.v_s"
               : !dt_is_finite(law->mu_v)      ? "friction.mu_v"
                                         : 0;
    }
    if (law->slip[0] < 0 || law->slip[0] > 0) {
        return "friction.slip";
    }
    for (int i = 0; i < law->points; ++i) {
        if (!at_least(law->mu[i], 0)) {
            return "friction.mu";
        }
        if (i > 0 && !more_than(law->slip[i], law->slip[i - 1])) {
            return "friction.slip";
        }
    }
    return 0;
}

static const char *check_clutch(const dt_clutch *clutch) {
    return !not_zero(clutch->i_c)                ? "i_c"
           : !not_zero(clutch->i_out)            ? "i_out"
           : !at_least(clutch->gain, 0)          ? "gain"
           : !dt_is_finite(clutch->P0)                 ? "P0"
           : !at_least(clutch->peak, 1)          ? "peak"
           : !at_least(clutch->drum_inertia, 0)  ? "drum_inertia"
                                                 : check_friction(&clutch->friction);
}

const char *dt_check(const dt_params *p) {
    const char *fault = !at_least(p->J1, 0)                               ? "J1"
                        : !at_least(p->J2e, 0)                            ? "J2e"
                        : !more_than(p->J1 + p->J2e, 0)                   ? "J1 + J2e"
                        : !more_than(p->eta, 0) || p->eta > DT_C(1.5)     ? "eta"
                        : !not_zero(p->i_in)                              ? "i_in"
                        : !more_than(p->J_out, 0)                         ? "J_out"
                        : !not_zero(p->i_f)                               ? "i_f"
                        : !more_than(p->J_v, 0)                           ? "J_v"
                        : !at_least(p->k_o, 0)                            ? "k_o"
                        : !at_least(p->c_o, 0)                            ? "c_o"
                        : !dt_is_finite(p->load_constant)                       ? "load.constant"
                        : !at_least(p->load_rolling, 0)                   ? "load.rolling"
                        : !at_least(p->load_aero, 0)                      ? "load.aero"
                        : p->loss_law != DT_PAPER && p->loss_law != DT_DISSIPATIVE ? "loss_law"
                                                                          : 0;
    for (int j = 0; j < DT_CLUTCHES && fault == 0; ++j) {
        fault = check_clutch(&p->clutch[j]);
    }
    if (fault == 0) {
        const dt_real first = p->clutch[0].i_c * p->clutch[0].i_out;
        const dt_real second = p->clutch[1].i_c * p->clutch[1].i_out;
        fault = dt_abs(first - second) > DT_C(1e-3) * dt_abs(first) ? 0 : "i_c * i_out";
    }
    return fault;
}

int dt_inputs_in_range(const dt_inputs *inputs) {
    int sound = dt_abs(inputs->engine_torque) <= DT_C(DT_MOST_TORQUE); /* NaN is not */
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        sound = sound && dt_abs(inputs->pressure[j]) <= DT_C(DT_MOST_PRESSURE);
    }
    return sound;
}

/* FNV-1a by whole numbers, with the upper half of each product folded into the lower. */
static uint64_t marked(uint64_t mark, const dt_real *values, int count) {
    for (int i = 0; i < count; ++i) {
        const union {
            dt_real value;
            dt_bits bits;
        } of = {values[i]};
        mark = (mark ^ of.bits) * 0x100000001b3U;
        mark ^= mark >> 32;
    }
    return mark;
}

uint64_t dt_mark(const dt_params *p) {
    const dt_real own[] = {p->J1,  p->J2e, p->eta,           p->i_in,         p->J_out,
                           p->i_f, p->J_v, p->k_o,           p->c_o,          p->load_constant,
                           p->load_rolling, p->load_aero, DT_C(p->loss_law)};
    uint64_t mark = marked(0xcbf29ce484222325U, own, (int)(sizeof own / sizeof own[0]));
    for (int j = 0; j < DT_CLUTCHES; ++j) {
        const dt_clutch *clutch = &p->clutch[j];
        const dt_friction *law = &clutch->friction;
        const int points = law->points < DT_POINTS ? law->points : DT_POINTS;
        const dt_real each[] = {clutch->i_c,          clutch->i_out, clutch->gain,
                                clutch->P0,           clutch->peak,  clutch->drum_inertia,
                                DT_C(law->points),    law->mu_c,     law->mu_s,
                                law->v_s,             law->mu_v};
        mark = marked(mark, each, (int)(sizeof each / sizeof each[0]));
        mark = marked(mark, law->slip, points);
        mark = marked(mark, law->mu, points);
    }
    return mark;
}
