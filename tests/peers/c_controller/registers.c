/* The register map of drivers/register_maps/profiles/ring.toml: 0-based holding registers, high word first. */
#include "controller.h"

#include <string.h>

uint32_t crc32_of(const uint16_t *registers, int n, uint32_t crc)
{
    crc = ~crc; /* ISO-HDLC; going on where an earlier piece ended */
    for (int i = 0; i < 2 * n; i++) {
        crc ^= i % 2 ? registers[i / 2] & 0xFF : registers[i / 2] >> 8;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
    }
    return ~crc;
}

void put32(uint16_t *at, uint32_t value)
{
    at[0] = (uint16_t)(value >> 16);
    at[1] = (uint16_t)value;
}

void put_float(uint16_t *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    put32(at, bits);
}

uint32_t get32(const uint16_t *at)
{
    return (uint32_t)at[0] << 16 | at[1];
}

float get_float(const uint16_t *at)
{
    uint32_t bits = get32(at);
    float value;
    memcpy(&value, &bits, 4);
    return value;
}

static const int readable[][2] = {{0, 10}, {16, 41}, {64, 85}, {96, 105}, {256, 258}, {WINDOW, WINDOW_END}};
static const int writable[][2] = {{64, 85}, {96, 105}, {256, 258}};

static bool within(const int ranges[][2], int n_ranges, int address, int n)
{
    for (int i = 0; i < n_ranges; i++)
        if (address >= ranges[i][0] && address + n <= ranges[i][1])
            return true;
    return false;
}

int registers_may_read(int address, int n)
{
    return within(readable, 6, address, n) ? 0 : 2;
}

int registers_may_write(struct device *d, int address, int n, const uint16_t *values)
{
    if (!within(writable, 3, address, n))
        return 2;
    if (address <= WRITER && WRITER < address + n) {
        uint16_t asks = values[WRITER - address], holds = d->image[WRITER];
        if (asks && holds && asks != holds)
            return 3;
    }
    return 0;
}

static void status_registers(struct device *d, uint16_t *r)
{
    const struct status *s = &d->status;
    r[16] = s->word;
    r[17] = s->state;
    r[18] = s->fault;
    r[19] = s->echo;
    r[20] = s->reject;
    r[21] = s->done;
    put32(r + 22, s->cycles);
    r[24] = s->heartbeat;
    r[25] = s->remaining;
    r[26] = s->trips;
    r[27] = s->reason;
    put_float(r + 28, s->force);
    put_float(r + 30, s->stroke);
    put_float(r + 32, s->position);
    put_float(r + 34, s->command);
    put32(r + 36, s->tick_us);
    r[38] = d->image[REQUEST];
    put32(r + 39, crc32_of(r + 16, 23, 0));
}

void registers_read(struct device *d, int address, int n, uint16_t *into)
{
    uint16_t r[IMAGE];
    memcpy(r, d->image, sizeof r);
    r[0] = 0x4253;
    r[1] = 2;
    put_float(r + 2, -1234.5f);
    put32(r + 4, 0x12345678);
    put32(r + 6, d->options->serial);
    put_float(r + 8, (float)d->options->rate_Hz);
    if (address < 41)
        status_registers(d, r);
    if (address + n > WINDOW)
        samples_window(d, get32(d->image + ACKNOWLEDGE), d->status.made, d->status.word, r + WINDOW, WINDOW_END - WINDOW);
    memcpy(into, r + address, sizeof(uint16_t) * (size_t)n);
}
