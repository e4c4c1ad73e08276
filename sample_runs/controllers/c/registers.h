/* The register map: drivers/register_maps/profiles/ring.toml, edition 3. Holding registers, numbered from 0.
 * 32-bit values take two registers, the high word first.
 */
#ifndef REGISTERS_H
#define REGISTERS_H

#include <stdbool.h>
#include <stdint.h>

enum address {
    DEVICE_TYPE = 0, PROFILE_VERSION, TEST_FLOAT, TEST_INTEGER = 4, SERIAL = 6, SAMPLE_RATE = 8, SIMULATED = 10,
    IDENTITY_END = 11,
    STATUS_WORD = 16, STATE, FAULT_CODE, ECHO_SEQUENCE, REJECT_CODE, DONE_SEQUENCE, CYCLES_DONE, HEARTBEAT = 24,
    WATCHDOG_REMAINING, WATCHDOG_TRIPS, END_REASON, FORCE, STROKE = 30, POSITION = 32, COMMAND = 34, TICK = 36,
    REQUEST_ECHO = 38, STATUS_CHECK = 39, STATUS_END = 41,
    COMMAND_SEQUENCE = 64, COMMAND_CODE, TARGET, SPEED = 68, MEAN = 70, AMPLITUDE = 72, FREQUENCY = 74, CYCLES = 76,
    TURNING_FORCE = 78, TURNING_STROKE = 80, STATIC_PAUSE = 82, EXECUTE = 84, COMMAND_END = 85,
    CONTROL_WORD = 96, WATCHDOG_FEED, WATCHDOG_TIME, REQUEST_NUMBER, FORCE_LIMIT, STROKE_LIMIT = 102, WRITER = 104,
    CONTROL_END = 105,
    RING_ACKNOWLEDGE = 256, ACKNOWLEDGE_END = 258,
    WINDOW = 260, WINDOW_END = 381,
    REGISTERS = 400
};

enum exception { GRANTED = 0, ILLEGAL_FUNCTION = 1, ILLEGAL_ADDRESS = 2, ILLEGAL_VALUE = 3 }; /* of Modbus */

void put_u32(uint16_t *at, uint32_t value);
void put_float(uint16_t *at, float value);
uint32_t get_u32(const uint16_t *at);
float get_float(const uint16_t *at);

/* CRC-32 (ISO-HDLC, as zlib and Ethernet have it) of registers, each high byte first; `so_far` is 0 to begin with, or
 * the CRC of what comes before. */
uint32_t crc32_of(const uint16_t *registers, int count, uint32_t so_far);

/* Whether registers may be read or written; holes belong to nobody. */
bool may_read(int address, int count);
bool may_write(int address, int count);

#endif
