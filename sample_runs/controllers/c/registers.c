#include "registers.h"

#include <string.h>

void put_u32(uint16_t *at, uint32_t value)
{
    at[0] = (uint16_t)(value >> 16);
    at[1] = (uint16_t)value;
}

void put_float(uint16_t *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(at, bits);
}

uint32_t get_u32(const uint16_t *at)
{
    return (uint32_t)at[0] << 16 | at[1];
}

float get_float(const uint16_t *at)
{
    uint32_t bits = get_u32(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t with_byte(uint32_t crc, uint8_t byte)
{
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++)
        crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    return crc;
}

uint32_t crc32_of(const uint16_t *registers, int count, uint32_t so_far)
{
    uint32_t crc = ~so_far;
    for (int i = 0; i < count; i++) {
        crc = with_byte(crc, (uint8_t)(registers[i] >> 8));
        crc = with_byte(crc, (uint8_t)registers[i]);
    }
    return ~crc;
}

static bool lies_in(int address, int count, int begin, int end)
{
    return address >= begin && address + count <= end;
}

bool may_write(int address, int count)
{
    return lies_in(address, count, COMMAND_SEQUENCE, COMMAND_END) || lies_in(address, count, CONTROL_WORD, CONTROL_END) ||
           lies_in(address, count, RING_ACKNOWLEDGE, ACKNOWLEDGE_END);
}

bool may_read(int address, int count)
{
    return may_write(address, count) || lies_in(address, count, DEVICE_TYPE, IDENTITY_END) ||
           lies_in(address, count, STATUS_WORD, STATUS_END) || lies_in(address, count, WINDOW, WINDOW_END);
}
