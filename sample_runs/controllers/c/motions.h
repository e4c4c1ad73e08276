/* The motions: each moves the command of the piston by one cycle, and says when it has ended. */
#ifndef MOTIONS_H
#define MOTIONS_H

#include <stdbool.h>
#include <stdint.h>

enum code { HOLD = 1, RAMP = 2, HARMONIC = 3, STATIC = 4, RELEASE = 5, ADJUST = 6 }; /* register command_code */
enum reason { GOES_ON, REACHED, FORCE_REACHED, COMMANDED, BY_WATCHDOG, BY_LIMIT }; /* register end_reason */

struct order { /* the command block as it was armed */
    uint16_t sequence, code;
    float target_mm, speed_mm_per_s;
    float mean_mm, amplitude_mm, frequency_Hz;
    uint32_t cycles;
    float turning_force_kN, turning_stroke_mm, pause_s;
};

struct motion {
    struct order order;
    double command_mm, rate_mm_per_s; /* of the command */
    uint32_t cycles_done;
    double cycle; /* of a sine: since it began, in cycles */
    double mean_mm, amplitude_mm; /* of a sine, as they are at the moment */
    double from_mean_mm, from_amplitude_mm, changed_at; /* the change under way began so; changed_at < 0: none */
    double braking_mm_per_s2; /* of a hold: 0 where it stands at once */
    enum { LOADING, UNLOADING, RESTING } phase; /* of static cycles */
    double rest_s;
    enum reason turned_by;
};

struct measured {
    double force_kN, stroke_mm, position_mm;
};

/* Begins a motion from where the command stands and as fast as it moves. */
void motion_begin(struct motion *motion, const struct order *order);

/* Moves the command by dt_s; GOES_ON, or why the motion has ended. */
enum reason motion_step(struct motion *motion, double dt_s, const struct measured *measured);

/* Whether mean and amplitude of the running sine may be changed: at full amplitude, no change under way, a cycle left. */
bool motion_adjustable(const struct motion *motion);

/* Has the running sine go over to the mean and amplitude of an order within one cycle. */
void motion_adjust(struct motion *motion, const struct order *order);

#endif
