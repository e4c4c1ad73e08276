/* A ring controller's register map behind libmodbus: the second implementation that the driver must get on with.
 *
 * usage: libmodbus_server tcp PORT | libmodbus_server rtu DEVICE BAUD
 * TCP port 0 takes a free one. Prints "ready PORT" when it listens. Ends when standard input does (TCP: between
 * two requests).
 *
 * Every FC23 that writes ring_acknowledge makes a new window: 14 samples a read, counted up by sequence, with
 * the CRC-32 of profile "ring". Command, execute and control words are obeyed as far as a client can tell.
 */
#include <errno.h>
#include <modbus.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <netinet/in.h>
#include <sys/socket.h>

enum { SIZE = 512, STATUS = 16, STATUS_CHECK = 39, COMMAND = 64, EXECUTE = 84, CONTROL = 96, REQUEST = 99,
       ACKNOWLEDGE = 256, WINDOW = 260, HEADER = 9, WORDS = 8, ROWS = 14 };

static uint16_t words[SIZE];
static uint32_t total; /* samples taken so far */

static void put32(int at, uint32_t value) { words[at] = (uint16_t)(value >> 16); words[at + 1] = (uint16_t)value; }
static uint32_t get32(int at) { return (uint32_t)words[at] << 16 | words[at + 1]; }
static void put_float(int at, float value) { uint32_t bits; memcpy(&bits, &value, 4); put32(at, bits); }

static uint32_t crc32_words(uint32_t crc, int first, int count)
{
    for (int i = first; i < first + count; i++)
        for (int half = 1; half >= 0; half--) {
            crc ^= half ? words[i] >> 8 : words[i] & 0xFF;
            for (int bit = 0; bit < 8; bit++)
                crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
        }
    return crc;
}

static void begin(void)
{
    words[0] = 0x4253;
    words[1] = 2;
    put_float(2, -1234.5f);
    put32(4, 0x12345678);
    put32(6, 316);
    put_float(8, 1000.0f);
    words[STATUS] = 0x0240;
}

static void make_window(void)
{
    uint32_t asked = get32(ACKNOWLEDGE);
    uint32_t first = asked < total ? asked : total;
    int count = total - first < ROWS ? (int)(total - first) : ROWS;
    memset(words + WINDOW, 0, 121 * sizeof words[0]);
    put32(WINDOW, asked);
    put32(WINDOW + 2, first);
    words[WINDOW + 4] = (uint16_t)count;
    words[WINDOW + 6] = words[STATUS];
    for (int i = 0; i < count; i++) {
        int at = WINDOW + HEADER + i * WORDS;
        uint32_t sequence = first + (uint32_t)i;
        put32(at, (sequence + 1) * 1000);
        put32(at + 2, sequence * 7 - 1000000);
        words[at + 4] = (uint16_t)sequence;
        words[at + 5] = (uint16_t)(sequence + 1);
        words[at + 6] = (uint16_t)-(int)(sequence % 30000);
        words[at + 7] = (uint16_t)(sequence % 30000);
    }
    uint32_t crc = crc32_words(0xFFFFFFFFu, WINDOW, HEADER - 2);
    put32(WINDOW + 7, ~crc32_words(crc, WINDOW + HEADER, count * WORDS));
}

static void show_status(void)
{
    words[STATUS + 8]++; /* heartbeat */
    words[STATUS + 22] = words[REQUEST];
    put32(STATUS_CHECK, ~crc32_words(0xFFFFFFFFu, STATUS, STATUS_CHECK - STATUS));
}

/* What a write means, found by its first address; called before the reply is made. */
static void obey(int address, const uint8_t *data, int count)
{
    uint16_t first = (uint16_t)(data[0] << 8 | data[1]);
    for (int i = 0; i < count && address + i < SIZE; i++)
        words[address + i] = (uint16_t)(data[2 * i] << 8 | data[2 * i + 1]);
    if (address == ACKNOWLEDGE) {
        total += 10;
        make_window();
    } else if (address == COMMAND) {
        words[STATUS + 3] = first; /* echo_sequence */
        words[STATUS + 4] = words[COMMAND + 1] > 5; /* reject_code */
    } else if (address == EXECUTE) {
        words[STATUS + 5] = first; /* done_sequence: at once */
        words[STATUS + 11] = 1;    /* end_reason: reached */
    } else if (address == CONTROL) {
        uint16_t shown = first == 0x0F ? 0x0237 : first == 0x07 ? 0x0233 : first == 0x06 ? 0x0231 : 0x0240;
        words[STATUS] = shown;
        words[STATUS + 1] = first == 0x0F ? 2 : 0;
    }
}

static int word_at(const uint8_t *pdu, int at) { return pdu[at] << 8 | pdu[at + 1]; }

static void serve(modbus_t *context, modbus_mapping_t *map)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    for (;;) {
        struct pollfd ends[2] = {{STDIN_FILENO, POLLIN, 0}, {modbus_get_socket(context), POLLIN, 0}};
        if (poll(ends, 2, -1) < 0 || ends[0].revents)
            exit(0);
        int length = modbus_receive(context, query);
        if (length == -1) {
            if (errno == EMBBADCRC || errno == ETIMEDOUT)
                continue;
            return; /* the client has gone */
        }
        if (length == 0)
            continue;
        const uint8_t *pdu = query + modbus_get_header_length(context);
        memcpy(words, map->tab_registers, sizeof words);
        if (pdu[0] == 6)
            obey(word_at(pdu, 1), pdu + 3, 1);
        else if (pdu[0] == 16)
            obey(word_at(pdu, 1), pdu + 6, word_at(pdu, 3));
        else if (pdu[0] == 23)
            obey(word_at(pdu, 5), pdu + 10, word_at(pdu, 7));
        show_status();
        memcpy(map->tab_registers, words, sizeof words);
        if (modbus_reply(context, query, length, map) == -1)
            return;
    }
}

int main(int argc, char **argv)
{
    modbus_mapping_t *map = modbus_mapping_new(0, 0, SIZE, 0);
    if (argc < 3 || map == NULL)
        return 2;
    begin();
    memcpy(map->tab_registers, words, sizeof words);
    if (strcmp(argv[1], "rtu") == 0) {
        modbus_t *line = modbus_new_rtu(argv[2], atoi(argv[3]), 'E', 8, 1);
        if (line == NULL || modbus_set_slave(line, 1) == -1 || modbus_connect(line) == -1) {
            fprintf(stderr, "%s\n", modbus_strerror(errno));
            return 2;
        }
        printf("ready 0\n");
        fflush(stdout);
        for (;;)
            serve(line, map);
    }
    modbus_t *net = modbus_new_tcp("127.0.0.1", atoi(argv[2]));
    int listener = modbus_tcp_listen(net, 1);
    struct sockaddr_in bound;
    socklen_t size = sizeof bound;
    if (listener == -1 || getsockname(listener, (struct sockaddr *)&bound, &size) == -1) {
        fprintf(stderr, "%s\n", modbus_strerror(errno));
        return 2;
    }
    printf("ready %d\n", ntohs(bound.sin_port));
    fflush(stdout);
    for (;;) {
        struct pollfd ends[2] = {{STDIN_FILENO, POLLIN, 0}, {listener, POLLIN, 0}};
        if (poll(ends, 2, -1) < 0 || ends[0].revents)
            return 0;
        if (modbus_tcp_accept(net, &listener) != -1)
            serve(net, map);
        modbus_close(net);
    }
}
