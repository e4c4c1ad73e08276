/* The ring of samples: each has a number that is never used twice, and is asked for by it. */
#ifndef RING_H
#define RING_H

#include "hal.h"
#include "settings.h"

#include <stdint.h>

enum { HEADER_WORDS = 9, SAMPLE_WORDS = 8, SAMPLES_A_BLOCK = 14 };

struct ring_sample {
    struct inputs inputs;
    int16_t command; /* counts, as the position's */
};

struct ring {
    struct ring_sample samples[RING_SAMPLES]; /* number n lies in n % RING_SAMPLES */
    uint64_t next; /* number of the sample that comes next; the wire has its lower 32 bits */
    uint16_t overruns; /* requests for what was overwritten */
};

void ring_put(struct ring *ring, const struct inputs *inputs, double command_mm);

/* Writes the window for whoever asks for sample `asked` (lower 32 bits) and what follows. */
void ring_window(struct ring *ring, uint32_t asked, uint16_t status_word, uint16_t *window);

#endif
