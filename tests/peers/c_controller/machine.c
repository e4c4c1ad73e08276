/* The machine that this controller moves: servo valve, piston, frame and a spring with friction.
 *
 * Piston: proportional loop, the valve follows with a first-order lag; under load less oil flows
 * (square root of what is left of the pressure), so the loop is softer into the specimen than out of it.
 * Frame: position = stroke + force / frame stiffness.
 * Spring: F(x) = E(x) (1 + mu z) with E progressive from a preload, and friction z by Dahl's law
 * dz/dx = (1 - z sgn dx) / l, integrated exactly over each step. No force without contact.
 */
#include "controller.h"

#include <math.h>

static const double GAIN_PER_S = 55.0, VALVE_LAG_S = 0.006, TOP_SPEED = 850.0, STALL_kN = 900.0;
static const double LEAK_MM_PER_S_kN = 0.03; /* a closed valve under load */
static const double FRAME_kN_PER_MM = 140.0;
static const double PRELOAD_kN = 12.0, CONTACT_MM = 0.3, LINEAR = 1.6, CUBIC = 4e-4;
static const double FRICTION = 0.13, FRICTION_LENGTH_MM = 2.5;
static const double FILTER_S = 0.004;

static double elastic_kN(double x)
{
    return x <= 0.0 ? 0.0 : PRELOAD_kN * fmin(x / CONTACT_MM, 1.0) + LINEAR * x + CUBIC * x * x * x;
}

static double friction_after(double z, double dx)
{
    return dx >= 0.0 ? 1.0 - (1.0 - z) * exp(-dx / FRICTION_LENGTH_MM)
                     : -1.0 + (1.0 + z) * exp(dx / FRICTION_LENGTH_MM);
}

static double force_at(const struct machine *m, double x)
{
    return elastic_kN(x) * (1.0 + FRICTION * friction_after(m->friction, x - m->stroke_mm));
}

void machine_start(struct machine *m, unsigned seed)
{
    *m = (struct machine){.position_mm = 0.0, .friction = -1.0, .random = 0x9E3779B97F4A7C15ull ^ seed};
}

double machine_noise(struct machine *m)
{
    double sum = -6.0; /* twelve uniform numbers: near enough to normal for a transducer */
    for (int i = 0; i < 12; i++) {
        m->random = m->random * 6364136223846793005ull + 1442695040888963407ull;
        sum += (double)(m->random >> 11) / 9007199254740992.0;
    }
    return sum;
}

static void specimen_to(struct machine *m)
{
    /* stroke + force(stroke) / frame = position: rises with stroke, so bisection always finds it */
    double low = fmin(m->stroke_mm, m->position_mm) - 6.0, high = m->position_mm;
    if (m->position_mm <= 0.0)
        low = high; /* clear of the specimen */
    for (int i = 0; i < 44 && high > low; i++) {
        double middle = 0.5 * (low + high);
        if (middle + force_at(m, middle) / FRAME_kN_PER_MM > m->position_mm)
            high = middle;
        else
            low = middle;
    }
    double x = 0.5 * (low + high);
    m->force_kN = force_at(m, x);
    m->friction = friction_after(m->friction, x - m->stroke_mm);
    m->stroke_mm = x;
}

void machine_step(struct machine *m, double command_mm, double dt_s)
{
    const int parts = 4;
    double dt = dt_s / parts;
    for (int i = 0; i < parts; i++) {
        if (m->valve_open) {
            double wanted = GAIN_PER_S * (command_mm - m->position_mm);
            double against = wanted > 0.0 ? m->force_kN : -m->force_kN;
            wanted = fmax(-TOP_SPEED, fmin(TOP_SPEED, wanted)) * sqrt(fmax(0.05, 1.0 - against / STALL_kN));
            m->valve_mm_per_s += (wanted - m->valve_mm_per_s) * (1.0 - exp(-dt / VALVE_LAG_S));
        } else {
            m->valve_mm_per_s = -LEAK_MM_PER_S_kN * m->force_kN;
        }
        m->position_mm += m->valve_mm_per_s * dt;
        specimen_to(m);
    }
    m->drift_kN += -m->drift_kN * dt_s / 0.05 + 0.03 * sqrt(dt_s / 0.05) * machine_noise(m);
    m->measured_kN += (m->force_kN + m->drift_kN - m->measured_kN) * (1.0 - exp(-dt_s / FILTER_S));
}
