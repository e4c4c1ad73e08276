/* A client on libmodbus that drives a controller of profile "ring": arm, execute, watch, read the ring.
 *
 * usage: libmodbus_client tcp PORT | libmodbus_client rtu DEVICE BAUD
 * Switches on, ramps to 12 mm at 40 mm/s, reads the ring all the while, and prints one line:
 *   samples N first S last S broken B position P state X done D
 * broken counts samples that are missing, doubled or out of step, and blocks whose CRC is wrong.
 */
#include <errno.h>
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void demand(int result, const char *what)
{
    if (result == -1) {
        fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
        exit(1);
    }
}

static uint32_t get32(const uint16_t *at) { return (uint32_t)at[0] << 16 | at[1]; }
static void put_float(uint16_t *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    at[0] = (uint16_t)(bits >> 16);
    at[1] = (uint16_t)bits;
}
static float get_float(const uint16_t *at)
{
    uint32_t bits = get32(at);
    float value;
    memcpy(&value, &bits, 4);
    return value;
}

static uint32_t crc_of(uint32_t crc, const uint16_t *words, int count)
{
    for (int i = 0; i < 2 * count; i++) {
        crc ^= i % 2 ? words[i / 2] & 0xFF : words[i / 2] >> 8;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
    return crc;
}

int main(int argc, char **argv)
{
    if (argc < 3)
        return 2;
    modbus_t *wire = strcmp(argv[1], "rtu") == 0 ? modbus_new_rtu(argv[2], atoi(argv[3]), 'E', 8, 1)
                                                 : modbus_new_tcp("127.0.0.1", atoi(argv[2]));
    modbus_set_slave(wire, 1);
    modbus_set_response_timeout(wire, 5, 0);
    demand(modbus_connect(wire), "connect");
    const uint16_t words_on[] = {0x06, 0x07, 0x0F};
    for (int i = 0; i < 3; i++)
        demand(modbus_write_register(wire, 96, words_on[i]), "switch on");
    uint16_t command[20] = {1, 2}; /* sequence 1: ramp to stroke */
    put_float(command + 2, 12.0f);
    put_float(command + 4, 40.0f);
    demand(modbus_write_registers(wire, 64, 20, command), "arm");
    uint16_t status[25];
    demand(modbus_read_registers(wire, 16, 25, status), "status");
    if (status[3] != 1 || status[4] != 0) {
        fprintf(stderr, "armed: echo %d, reject %d\n", status[3], status[4]);
        return 1;
    }
    demand(modbus_write_register(wire, 84, 1), "execute");
    uint32_t wanted = 0, first = 0, tick = 0, samples = 0, broken = 0;
    for (int pass = 0; pass < 20000; pass++) {
        uint16_t ask[2] = {(uint16_t)(wanted >> 16), (uint16_t)wanted}, window[121];
        demand(modbus_write_and_read_registers(wire, 256, 2, ask, 260, 121, window), "ring");
        int count = window[4];
        uint32_t begin = get32(window + 2);
        if (~crc_of(crc_of(0xFFFFFFFFu, window, 7), window + 9, 8 * count) != get32(window + 7))
            broken++;
        if (samples == 0 && count)
            first = begin;
        else if (begin != wanted)
            broken++;
        for (int i = 0; i < count; i++) {
            uint32_t now = get32(window + 9 + 8 * i);
            broken += samples && now - tick != 1000;
            tick = now;
            samples++;
        }
        wanted = begin + (uint32_t)count;
        demand(modbus_read_registers(wire, 16, 25, status), "status");
        if (status[5] == 1 && count < 14)
            break;
        if (count == 0)
            usleep(2000);
    }
    printf("samples %u first %u last %u broken %u position %.3f state %d done %d\n", samples, first, wanted - 1,
           broken, get_float(status + 16), status[1], status[5]);
    demand(modbus_write_register(wire, 96, 0), "switch off");
    modbus_close(wire);
    modbus_free(wire);
    return 0;
}
