/* The hardware behind the controller: everything that is not the same on every machine.
 *
 * hal_simulated.c has a machine made of physics. For a real one write hal.c beside it with your converters, your valve
 * and your clock, and put it into the Makefile's HAL.
 */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

/* One sample: all channels taken at one instant, and that instant. */
struct inputs {
    uint64_t time_us; /* when it was taken, by a clock that never stands and never goes back */
    int32_t force; /* counts, see settings.h */
    uint16_t stroke_1, stroke_2;
    int16_t position;
};

struct outputs {
    bool valve; /* false: closed, the piston is blocked or without pressure, whatever the command says */
    double command_mm; /* for the position loop of the piston */
};

/* Makes the hardware ready, valve closed. Returns 0, or -1 with errno. */
int hal_open(double rate_Hz);

/* Waits for the next cycle and takes its sample. Returns false where the hardware cannot be read: the valve is to
 * be closed then (fault 4). A cycle that was missed is left out: the time of the next one shows it. */
bool hal_sample(struct inputs *sampled);

void hal_drive(const struct outputs *outputs);

/* Closes the valve and lets go of the hardware. */
void hal_close(void);

/* True only for hal_simulated.c: a program that is to move a real stand asks its operator first. */
bool hal_is_simulated(void);

#endif
