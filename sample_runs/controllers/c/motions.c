#include "motions.h"
#include "settings.h"

#include <math.h>

static const double TWO_PI = 6.283185307179586;

/* 0 ... 1 over share 0 ... 1, by half a cosine: neither the value nor its rate jumps. */
static double eased(double share)
{
    return 0.5 * (1.0 - cos(0.5 * TWO_PI * fmax(0.0, fmin(1.0, share))));
}

void motion_begin(struct motion *m, const struct order *order)
{
    bool from_sine = m->order.code == HARMONIC;
    double omega = TWO_PI * m->order.frequency_Hz;
    double most_mm = fmax(m->amplitude_mm, m->from_amplitude_mm);
    m->order = *order;
    if (order->code == HOLD) {
        /* A sine that is braked with A w^2 comes to rest within mean -+ A, whatever its phase. */
        m->braking_mm_per_s2 = from_sine ? most_mm * omega * omega : 0.0;
        if (!from_sine)
            m->rate_mm_per_s = 0.0;
        return;
    }
    m->cycles_done = 0;
    m->cycle = 0.0;
    m->mean_mm = order->mean_mm;
    m->amplitude_mm = m->from_amplitude_mm = order->amplitude_mm;
    m->changed_at = -1.0;
    m->phase = LOADING;
    m->rest_s = 0.0;
    m->turned_by = GOES_ON;
}

static bool settled(const struct motion *m, const struct measured *measured)
{
    return fabs(measured->position_mm - m->command_mm) < SETTLED_MM;
}

/* One step towards a target; true where the command is there. */
static bool step_to(struct motion *m, double target_mm, double speed_mm_per_s, double dt_s)
{
    double rest_mm = target_mm - m->command_mm, step_mm = speed_mm_per_s * dt_s;
    if (fabs(rest_mm) <= step_mm) {
        m->command_mm = target_mm;
        m->rate_mm_per_s = 0.0;
        return true;
    }
    m->command_mm += copysign(step_mm, rest_mm);
    m->rate_mm_per_s = copysign(speed_mm_per_s, rest_mm);
    return false;
}

static enum reason hold(struct motion *m, double dt_s, const struct measured *measured)
{
    double loss = m->braking_mm_per_s2 * dt_s;
    if (loss > 0.0 && fabs(m->rate_mm_per_s) > loss) {
        m->rate_mm_per_s -= copysign(loss, m->rate_mm_per_s);
        m->command_mm += m->rate_mm_per_s * dt_s;
        return GOES_ON;
    }
    m->rate_mm_per_s = 0.0;
    return settled(m, measured) ? REACHED : GOES_ON;
}

/* Mean and amplitude of a sine at its present phase: they may be on the way to others. */
static void change(struct motion *m)
{
    const struct order *to = &m->order;
    double share = m->changed_at < 0.0 ? 1.0 : eased(m->cycle - m->changed_at);
    m->mean_mm = m->from_mean_mm + share * (to->mean_mm - m->from_mean_mm);
    m->amplitude_mm = m->from_amplitude_mm + share * (to->amplitude_mm - m->from_amplitude_mm);
    if (m->changed_at < 0.0 || m->cycle >= m->changed_at + 1.0) {
        m->mean_mm = to->mean_mm;
        m->amplitude_mm = m->from_amplitude_mm = to->amplitude_mm;
        m->changed_at = -1.0;
    }
}

static enum reason harmonic(struct motion *m, double dt_s, const struct measured *measured)
{
    double all = m->order.cycles + 2.0, before_mm = m->command_mm;
    m->cycle = fmin(m->cycle + m->order.frequency_Hz * dt_s, all);
    change(m);
    double full = floor(m->cycle) - 1.0;
    m->cycles_done = full <= 0.0 ? 0 : (uint32_t)fmin(full, m->order.cycles);
    /* One cycle in, one out. At its end the envelope is 0, so the command stands at the mean. */
    double envelope = eased(fmin(m->cycle, all - m->cycle));
    m->command_mm = m->mean_mm + envelope * m->amplitude_mm * sin(TWO_PI * m->cycle);
    m->rate_mm_per_s = (m->command_mm - before_mm) / dt_s;
    return m->cycle >= all && settled(m, measured) ? REACHED : GOES_ON;
}

static enum reason static_cycles(struct motion *m, double dt_s, const struct measured *measured)
{
    const struct order *o = &m->order;
    switch (m->phase) {
    case LOADING:
        if (measured->force_kN >= o->turning_force_kN || measured->position_mm >= o->turning_stroke_mm) {
            m->turned_by = measured->force_kN >= o->turning_force_kN ? FORCE_REACHED : REACHED;
            m->phase = UNLOADING;
        } else {
            m->command_mm += o->speed_mm_per_s * dt_s;
            m->rate_mm_per_s = o->speed_mm_per_s;
        }
        return GOES_ON;
    case UNLOADING:
        if (step_to(m, 0.0, o->speed_mm_per_s, dt_s) && settled(m, measured) &&
            fabs(measured->force_kN) < NO_FORCE_KN) {
            m->cycles_done++;
            m->rest_s = 0.0;
            m->phase = RESTING;
        }
        return GOES_ON;
    default:
        if (m->cycles_done >= o->cycles)
            return m->turned_by;
        m->rest_s += dt_s;
        if (m->rest_s >= o->pause_s)
            m->phase = LOADING;
        return GOES_ON;
    }
}

/* To the piston's zero, and slowly on until the force is gone; a transducer that shows force there is wrong. */
static enum reason release(struct motion *m, double dt_s, const struct measured *measured)
{
    if (m->command_mm > 0.0) {
        step_to(m, 0.0, m->order.speed_mm_per_s, dt_s);
        return GOES_ON;
    }
    m->rate_mm_per_s = 0.0;
    if (fabs(measured->force_kN) < NO_FORCE_KN)
        return settled(m, measured) ? REACHED : GOES_ON;
    return step_to(m, -RELEASE_BEYOND_MM, RELEASE_SLOWLY_MM_PER_S, dt_s) ? BY_LIMIT : GOES_ON;
}

enum reason motion_step(struct motion *m, double dt_s, const struct measured *measured)
{
    switch (m->order.code) {
    case HOLD:
        return hold(m, dt_s, measured);
    case RAMP:
        return step_to(m, m->order.target_mm, m->order.speed_mm_per_s, dt_s) && settled(m, measured) ? REACHED : GOES_ON;
    case HARMONIC:
        return harmonic(m, dt_s, measured);
    case STATIC:
        return static_cycles(m, dt_s, measured);
    default:
        return release(m, dt_s, measured);
    }
}

bool motion_adjustable(const struct motion *m)
{
    return m->order.code == HARMONIC && m->changed_at < 0.0 && m->cycle >= 1.0 && m->cycle <= m->order.cycles;
}

void motion_adjust(struct motion *m, const struct order *order)
{
    m->from_mean_mm = m->mean_mm;
    m->from_amplitude_mm = m->amplitude_mm;
    m->changed_at = m->cycle;
    m->order.mean_mm = order->mean_mm;
    m->order.amplitude_mm = order->amplitude_mm;
}
