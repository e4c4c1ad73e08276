#include "ring.h"
#include "registers.h"

#include <math.h>
#include <string.h>

void ring_put(struct ring *ring, const struct inputs *inputs, double command_mm)
{
    double command = rint(command_mm / POSITION_MM_PER_COUNT);
    ring->samples[ring->next % RING_SAMPLES] = (struct ring_sample){
        .inputs = *inputs,
        .command = (int16_t)fmax(-32768.0, fmin(32767.0, command)),
    };
    ring->next++;
}

static void put_sample(const struct ring_sample *sample, uint16_t *at)
{
    put_u32(at, (uint32_t)sample->inputs.time_us);
    put_u32(at + 2, (uint32_t)sample->inputs.force);
    at[4] = sample->inputs.stroke_1;
    at[5] = sample->inputs.stroke_2;
    at[6] = (uint16_t)sample->inputs.position;
    at[7] = (uint16_t)sample->command;
}

/* The first sample to give: the one asked for, the oldest that is left, or none (then it is the next one). */
static uint64_t first_for(struct ring *ring, uint32_t asked)
{
    uint32_t behind = (uint32_t)ring->next - asked; /* so many samples since; half a wrap or more: not yet made */
    if (behind == 0 || behind >= 0x80000000u)
        return ring->next;
    uint64_t held = ring->next < RING_SAMPLES ? ring->next : RING_SAMPLES;
    if (behind <= held)
        return ring->next - behind;
    if (ring->next > held) /* a number from before the first sample was never overwritten */
        ring->overruns++;
    return ring->next - held;
}

void ring_window(struct ring *ring, uint32_t asked, uint16_t status_word, uint16_t *window)
{
    uint64_t first = first_for(ring, asked);
    uint16_t count = 0, *at = window + HEADER_WORDS;
    memset(window, 0, sizeof(uint16_t) * (WINDOW_END - WINDOW));
    for (; count < SAMPLES_A_BLOCK && first + count < ring->next; count++, at += SAMPLE_WORDS)
        put_sample(&ring->samples[(first + count) % RING_SAMPLES], at);
    put_u32(window, asked);
    put_u32(window + 2, (uint32_t)first);
    window[4] = count;
    window[5] = ring->overruns;
    window[6] = status_word;
    put_u32(window + 7, crc32_of(window + HEADER_WORDS, SAMPLE_WORDS * count, crc32_of(window, 7, 0)));
}
