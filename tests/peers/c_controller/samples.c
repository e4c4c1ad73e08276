/* Samples: taken each period, kept in the ring, written to the truth file, shown through the window. */
#include "controller.h"

#include <math.h>
#include <string.h>

/* One row of the truth file, little endian, 36 bytes: tests read it with numpy. */
struct __attribute__((packed)) truth_row {
    uint32_t sequence, tick_us;
    int32_t force;
    uint16_t stroke_1, stroke_2;
    int16_t position, command;
    float true_force_kN, true_stroke_mm;
    uint16_t state, status_word, boot, missed;
};

static double bounded(double counts, double low, double high)
{
    return fmax(low, fmin(high, rint(counts)));
}

void samples_take(struct device *d)
{
    struct machine *m = &d->machine;
    struct sample s = {
        .sequence = d->sequence,
        .tick_us = (uint32_t)(uint64_t)llrint(d->clock_s * 1e6) + d->options->tick_start_us,
        /* 0.1 N a count; draw wires 5 um a count from 8000 on, one left, one right of a slightly tilted specimen */
        .force = (int32_t)bounded((m->measured_kN + 0.06 * machine_noise(m)) * 1e4, -8e6, 8e6),
        .stroke_1 = (uint16_t)bounded(8000.0 + (m->stroke_mm * 1.002 + 0.008 * machine_noise(m)) * 200.0, 0, 65535),
        .stroke_2 = (uint16_t)bounded(8000.0 + (m->stroke_mm * 0.998 + 0.008 * machine_noise(m)) * 200.0, 0, 65535),
        .position = (int16_t)bounded(m->position_mm * 100.0, -32768, 32767),
        .command = (int16_t)bounded(d->motion.command_mm * 100.0, -32768, 32767),
    };
    d->ring.held[d->ring.made % (uint64_t)d->ring.size] = s;
    d->ring.made++;
    d->produced++;
    if (d->truth) {
        struct truth_row row = {(uint32_t)s.sequence, s.tick_us, s.force, s.stroke_1, s.stroke_2, s.position, s.command,
                                (float)m->force_kN, (float)m->stroke_mm, d->status.state, d->status.word, d->boot,
                                (uint16_t)d->missed};
        fwrite(&row, sizeof row, 1, d->truth);
    }
}

/* The window as the profile has it: header of 9 registers (asked, first, count, overruns, status word, check) and up to
 * 14 samples of 8. Samples made after `made` are not published yet. Samples in a block follow each other without a hole. */
int samples_window(struct device *d, uint32_t asked, uint64_t made, uint16_t status_word, uint16_t *window, int room)
{
    struct ring *r = &d->ring;
    uint64_t size = (uint64_t)r->size, oldest = r->made > size ? r->made - size : 0;
    uint64_t next = made ? r->held[(made - 1) % size].sequence + 1 : d->sequence;
    uint64_t wanted = next + (int64_t)(int32_t)(asked - (uint32_t)next);
    uint64_t from = made; /* nothing to give */
    if ((int64_t)(wanted - next) < 0 && oldest < made) {
        uint64_t low = oldest, high = made; /* the first held sample whose number is not below the wanted one */
        while (low < high) {
            uint64_t middle = (low + high) / 2;
            if ((int64_t)(r->held[middle % size].sequence - wanted) < 0)
                low = middle + 1;
            else
                high = middle;
        }
        from = low;
        if (from == oldest && oldest > 0 && r->held[from % size].sequence != wanted)
            r->overruns++;
    }
    int count = 0;
    uint16_t *at = window + 9;
    while (count < (room - 9) / 8 && from + (uint64_t)count < made) {
        struct sample *s = &r->held[(from + (uint64_t)count) % size];
        if (count && s->sequence != r->held[(from + (uint64_t)count - 1) % size].sequence + 1)
            break;
        put32(at, s->tick_us);
        put32(at + 2, (uint32_t)s->force);
        at[4] = s->stroke_1;
        at[5] = s->stroke_2;
        at[6] = (uint16_t)s->position;
        at[7] = (uint16_t)s->command;
        at += 8;
        count++;
    }
    put32(window, asked);
    put32(window + 2, count ? (uint32_t)r->held[from % size].sequence : (uint32_t)next);
    window[4] = (uint16_t)count;
    window[5] = r->overruns;
    window[6] = status_word;
    put32(window + 7, crc32_of(window + 9, 8 * count, crc32_of(window, 7, 0)));
    memset(at, 0, sizeof(uint16_t) * (size_t)(window + room - at));
    return count;
}
