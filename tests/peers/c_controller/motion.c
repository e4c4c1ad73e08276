/* The five motions: hold, ramp, harmonic, static cycles, release. Each moves the set point by one period. */
#include "controller.h"

#include <math.h>

static const double UNLOADED_kN = 0.2;
static const double ZERO_BEYOND_MM = 15.0; /* how far a release goes on behind zero to find no force */

void motion_begin(struct motion *m, const struct order *order)
{
    double amplitude = m->order.amplitude, omega = 2.0 * M_PI * m->order.frequency;
    bool from_sine = m->order.code == HARMONIC;
    m->order = *order;
    m->phase = 0;
    m->time_s = 0.0;
    m->turned_by = 0;
    if (order->code == HOLD) { /* a sine is braked within its own range, anything else stands at once */
        m->braking_mm_per_s2 = from_sine ? amplitude * omega * omega : 0.0;
        if (!from_sine)
            m->speed_mm_per_s = 0.0;
    } else {
        m->cycles_done = 0;
    }
}

static int toward(struct motion *m, double target_mm, double speed, double dt_s)
{
    double left = target_mm - m->command_mm, step = speed * dt_s;
    if (fabs(left) <= step) {
        m->command_mm = target_mm;
        m->speed_mm_per_s = 0.0;
        return 1;
    }
    m->command_mm += left > 0.0 ? step : -step;
    m->speed_mm_per_s = left > 0.0 ? speed : -speed;
    return 0;
}

static int hold(struct motion *m, double dt_s)
{
    double loss = m->braking_mm_per_s2 * dt_s;
    if (fabs(m->speed_mm_per_s) <= loss || m->braking_mm_per_s2 <= 0.0) {
        m->speed_mm_per_s = 0.0;
        return BY_TARGET;
    }
    m->speed_mm_per_s -= copysign(loss, m->speed_mm_per_s);
    m->command_mm += m->speed_mm_per_s * dt_s;
    return 0;
}

static int harmonic(struct motion *m, double dt_s)
{
    const struct order *o = &m->order;
    double before = m->command_mm;
    m->time_s += dt_s;
    double cycle = m->time_s * o->frequency, all = o->cycles + 2.0;
    if (cycle >= all) {
        m->command_mm = o->mean;
        m->speed_mm_per_s = 0.0;
        return BY_TARGET;
    }
    double share = 1.0; /* one cycle in, one out, by half a cosine */
    if (cycle < 1.0)
        share = 0.5 * (1.0 - cos(M_PI * cycle));
    else if (cycle > all - 1.0)
        share = 0.5 * (1.0 - cos(M_PI * (all - cycle)));
    m->command_mm = o->mean + share * o->amplitude * sin(2.0 * M_PI * cycle);
    m->speed_mm_per_s = (m->command_mm - before) / dt_s;
    double full = floor(cycle) - 1.0;
    m->cycles_done = full < 0.0 ? 0 : (uint32_t)fmin(full, o->cycles);
    return 0;
}

static int static_cycles(struct motion *m, double dt_s, double position_mm, double force_kN)
{
    const struct order *o = &m->order;
    switch (m->phase) {
    case 0: /* loading */
        m->command_mm += o->speed * dt_s;
        m->speed_mm_per_s = o->speed;
        if (force_kN >= o->turning_force || position_mm >= o->turning_stroke) {
            m->turned_by = force_kN >= o->turning_force ? BY_FORCE : BY_TARGET;
            m->phase = 1;
        }
        return 0;
    case 1: /* unloading, at once */
        if (toward(m, 0.0, o->speed, dt_s) && force_kN < UNLOADED_kN) {
            m->cycles_done++;
            m->time_s = 0.0;
            m->phase = 2;
        }
        return 0;
    default:
        if (m->cycles_done >= o->cycles)
            return m->turned_by;
        m->time_s += dt_s;
        if (m->time_s >= o->pause)
            m->phase = 0;
        return 0;
    }
}

static int release(struct motion *m, double dt_s, double force_kN)
{
    if (m->command_mm > 0.0)
        toward(m, 0.0, m->order.speed, dt_s);
    else if (force_kN >= UNLOADED_kN && m->command_mm > -ZERO_BEYOND_MM)
        toward(m, -ZERO_BEYOND_MM, fmin(m->order.speed, 2.0), dt_s);
    else if (force_kN < UNLOADED_kN) {
        m->speed_mm_per_s = 0.0;
        return BY_TARGET;
    }
    return 0;
}

int motion_step(struct motion *m, double dt_s, double position_mm, double force_kN)
{
    switch (m->order.code) {
    case HOLD: return hold(m, dt_s);
    case RAMP: return toward(m, m->order.target, m->order.speed, dt_s) ? BY_TARGET : 0;
    case HARMONIC: return harmonic(m, dt_s);
    case STATIC: return static_cycles(m, dt_s, position_mm, force_kN);
    default: return release(m, dt_s, force_kN);
    }
}
