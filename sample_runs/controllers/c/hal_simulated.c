/* A machine made of physics: piston behind a servo valve, frame, and a buffer between the plates.
 *
 * Piston    the valve lets it have v = gain (command - position), with a lag of the first order
 * Buffer    F(x) = E(x) (1 + MU z): E is a preload and a line, z in -1 ... 1 is dry friction by Dahl's law,
 *           dz/dx = (1 - z sgn dx) / l. Loading (z = 1) and unloading (z = -1) enclose the share 2 MU / (1 + MU) of the
 *           energy of loading, at any speed: that is what an evaluation must find, 0.23 here
 * Frame     position = stroke + F / k
 *
 * Its time is its own: where the computer is late it catches up, so that tests do not depend on how fast that is.
 * A real machine cannot: there time_us is the clock at the instant of the sample.
 */
#define _GNU_SOURCE
#include "hal.h"
#include "settings.h"

#include <errno.h>
#include <math.h>
#include <time.h>

static const double GAIN_PER_S = 60.0, LAG_S = 0.004, LEAK_MM_PER_S_KN = 0.02;
static const double FRAME_KN_PER_MM = 150.0;
static const double PRELOAD_KN = 8.0, PRELOAD_WITHIN_MM = 0.3, STIFFNESS_KN_PER_MM = 2.2;
static const double MU = 0.13, FRICTION_LENGTH_MM = 0.4;
static const double FORCE_NOISE_KN = 0.02, STROKE_NOISE_MM = 0.004, TILT = 0.002;
enum { STEPS = 4 }; /* of the physics in a cycle */

static struct {
    double period_s, position_mm, speed_mm_per_s, stroke_mm, force_kN, friction;
    uint64_t cycles, random;
    struct timespec began;
    struct outputs outputs;
} machine;

static double elastic_kN(double x)
{
    return x <= 0.0 ? 0.0 : PRELOAD_KN * fmin(x / PRELOAD_WITHIN_MM, 1.0) + STIFFNESS_KN_PER_MM * x;
}

/* Dahl's law over a step, exactly: z goes to the sign of the motion like exp(-|dx| / l). */
static double friction_after(double dx)
{
    double to = dx >= 0.0 ? 1.0 : -1.0;
    return to + (machine.friction - to) * exp(-fabs(dx) / FRICTION_LENGTH_MM);
}

static double force_at(double stroke_mm)
{
    return elastic_kN(stroke_mm) * (1.0 + MU * friction_after(stroke_mm - machine.stroke_mm));
}

/* Stroke + F(stroke) / k = position rises with the stroke, so halving an interval always finds it. */
static void press(void)
{
    double low = fmin(machine.stroke_mm, machine.position_mm) - 10.0, high = machine.position_mm;
    if (machine.position_mm <= 0.0)
        low = high; /* clear of the buffer */
    for (int i = 0; i < 40 && high - low > 1e-9; i++) {
        double middle = 0.5 * (low + high);
        if (middle + force_at(middle) / FRAME_KN_PER_MM > machine.position_mm)
            high = middle;
        else
            low = middle;
    }
    double stroke_mm = 0.5 * (low + high);
    machine.force_kN = force_at(stroke_mm);
    machine.friction = friction_after(stroke_mm - machine.stroke_mm);
    machine.stroke_mm = stroke_mm;
}

static void move(double dt_s)
{
    if (machine.outputs.valve) {
        double wanted = GAIN_PER_S * (machine.outputs.command_mm - machine.position_mm);
        wanted = fmax(-RATED_SPEED_MM_PER_S, fmin(RATED_SPEED_MM_PER_S, wanted));
        machine.speed_mm_per_s += (wanted - machine.speed_mm_per_s) * (1.0 - exp(-dt_s / LAG_S));
    } else {
        machine.speed_mm_per_s = -LEAK_MM_PER_S_KN * machine.force_kN; /* a closed valve leaks */
    }
    machine.position_mm += machine.speed_mm_per_s * dt_s;
    press();
}

static double noise(void)
{
    double sum = -6.0; /* twelve uniform numbers: near enough to normal, with variance 1 */
    for (int i = 0; i < 12; i++) {
        machine.random = machine.random * 6364136223846793005ull + 1442695040888963407ull;
        sum += (double)(machine.random >> 11) / 9007199254740992.0;
    }
    return sum;
}

static double counts(double value, double low, double high)
{
    return fmax(low, fmin(high, rint(value)));
}

static uint16_t stroke_counts(double stroke_mm)
{
    double mm = stroke_mm + STROKE_NOISE_MM * noise();
    return (uint16_t)counts((mm - STROKE_MM_AT_0) / STROKE_MM_PER_COUNT, 0.0, 65535.0);
}

int hal_open(double rate_Hz)
{
    machine.period_s = 1.0 / rate_Hz;
    machine.friction = -1.0;
    machine.random = 1;
    machine.outputs.valve = false;
    return clock_gettime(CLOCK_MONOTONIC, &machine.began);
}

static void sleep_until_cycle(void)
{
    double since_s = (double)machine.cycles * machine.period_s;
    struct timespec when = machine.began;
    when.tv_sec += (time_t)since_s;
    when.tv_nsec += (long)(1e9 * (since_s - floor(since_s)));
    if (when.tv_nsec >= 1000000000L) {
        when.tv_nsec -= 1000000000L;
        when.tv_sec++;
    }
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL) == EINTR)
        ;
}

bool hal_sample(struct inputs *sampled)
{
    machine.cycles++;
    sleep_until_cycle();
    for (int i = 0; i < STEPS; i++)
        move(machine.period_s / STEPS);
    sampled->time_us = (uint64_t)llrint((double)machine.cycles * machine.period_s * 1e6);
    sampled->force = (int32_t)counts((machine.force_kN + FORCE_NOISE_KN * noise()) / FORCE_KN_PER_COUNT, -8e6, 8e6);
    sampled->stroke_1 = stroke_counts(machine.stroke_mm * (1.0 + TILT));
    sampled->stroke_2 = stroke_counts(machine.stroke_mm * (1.0 - TILT));
    sampled->position = (int16_t)counts(machine.position_mm / POSITION_MM_PER_COUNT, -32768.0, 32767.0);
    return true;
}

void hal_drive(const struct outputs *outputs)
{
    machine.outputs = *outputs;
}

void hal_close(void)
{
    machine.outputs.valve = false;
}

bool hal_is_simulated(void)
{
    return true;
}
