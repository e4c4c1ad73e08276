#define _GNU_SOURCE
#include "server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdbool.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CLIENTS = 16, PATIENCE_MS = 100 };
enum { READ_SEVERAL = 3, WRITE_ONE = 6, WRITE_SEVERAL = 16, EXCHANGE = 23 };
enum { MOST_READ = 125, MOST_WRITTEN = 123, ILLEGAL_FUNCTION = 1, ILLEGAL_ADDRESS = 2, ILLEGAL_VALUE = 3 };

static int listener = -1;

int server_open(const char *address, int port)
{
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    socklen_t length = sizeof at;
    int yes = 1;
    if (inet_pton(AF_INET, address, &at.sin_addr) != 1) {
        errno = EINVAL;
        return -1;
    }
    listener = socket(AF_INET, SOCK_STREAM, 0);
    if (listener < 0 || setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) ||
        bind(listener, (struct sockaddr *)&at, length) || listen(listener, CLIENTS) ||
        getsockname(listener, (struct sockaddr *)&at, &length))
        return -1;
    return ntohs(at.sin_port);
}

struct request {
    int function, read_at, read_count, write_at, write_count;
    uint16_t written[MOST_WRITTEN];
};

static int word_at(const uint8_t *bytes)
{
    return bytes[0] << 8 | bytes[1];
}

/* Takes a request apart (Modbus application protocol 1.1b3, section 6); `length` are the bytes that came. */
static int parse(const uint8_t *pdu, int length, struct request *request)
{
    const uint8_t *data = NULL;
    *request = (struct request){.function = pdu[0]};
    switch (pdu[0]) {
    case READ_SEVERAL:
        request->read_at = word_at(pdu + 1), request->read_count = word_at(pdu + 3);
        break;
    case WRITE_ONE:
        request->write_at = word_at(pdu + 1), request->write_count = 1, data = pdu + 3;
        break;
    case WRITE_SEVERAL:
        request->write_at = word_at(pdu + 1), request->write_count = word_at(pdu + 3), data = pdu + 6;
        break;
    case EXCHANGE:
        request->read_at = word_at(pdu + 1), request->read_count = word_at(pdu + 3);
        request->write_at = word_at(pdu + 5), request->write_count = word_at(pdu + 7), data = pdu + 10;
        break;
    default:
        return ILLEGAL_FUNCTION;
    }
    bool reads = pdu[0] == READ_SEVERAL || pdu[0] == EXCHANGE;
    if ((reads && request->read_count < 1) || request->read_count > MOST_READ || (data && request->write_count < 1) ||
        request->write_count > MOST_WRITTEN || (data && data + 2 * request->write_count > pdu + length))
        return ILLEGAL_VALUE;
    for (int i = 0; i < request->write_count; i++)
        request->written[i] = (uint16_t)word_at(data + 2 * i);
    return 0;
}

static int carry_out(const struct served *served, const struct request *r, modbus_mapping_t *map)
{
    if (r->read_at + r->read_count > served->registers || r->write_at + r->write_count > served->registers)
        return ILLEGAL_ADDRESS;
    return served->exchange(served->device, r->write_at, r->write_count, r->written, r->read_at, r->read_count,
                            map->tab_registers + r->read_at);
}

/* Answers one request; false where the connection is to be closed. */
static bool answer(const struct served *served, modbus_t *modbus, modbus_mapping_t *map, int client, int unit)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    struct request request;
    modbus_set_socket(modbus, client);
    int length = modbus_receive(modbus, query), header = modbus_get_header_length(modbus);
    if (length <= header)
        return false;
    if (query[header - 1] != unit)
        return modbus_reply_exception(modbus, query, MODBUS_EXCEPTION_GATEWAY_TARGET) > 0;
    int refused = parse(query + header, length - header, &request);
    if (!refused)
        refused = carry_out(served, &request, map);
    if (refused)
        return modbus_reply_exception(modbus, query, (unsigned)refused) > 0;
    return modbus_reply(modbus, query, length, map) > 0; /* of the registers that were put into the map */
}

static void welcome(struct pollfd *clients)
{
    int yes = 1, client = accept(listener, NULL, NULL);
    for (int i = 0; client >= 0 && i < CLIENTS; i++)
        if (clients[i].fd < 0) {
            setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); /* libmodbus does not */
            clients[i] = (struct pollfd){.fd = client, .events = POLLIN};
            return;
        }
    if (client >= 0)
        close(client);
}

void server_run(const struct served *served, int unit, volatile sig_atomic_t *stop)
{
    modbus_t *modbus = modbus_new_tcp("0.0.0.0", 0); /* it only speaks: the sockets are ours */
    modbus_mapping_t *map = modbus_mapping_new(0, 0, served->registers, 0);
    struct pollfd watched[1 + CLIENTS] = {{.fd = listener, .events = POLLIN}};
    for (int i = 1; i <= CLIENTS; i++)
        watched[i].fd = -1;
    while (modbus && map && !*stop) {
        if (poll(watched, 1 + CLIENTS, PATIENCE_MS) <= 0)
            continue;
        if (watched[0].revents)
            welcome(watched + 1);
        for (int i = 1; i <= CLIENTS; i++)
            if (watched[i].fd >= 0 && watched[i].revents && !answer(served, modbus, map, watched[i].fd, unit)) {
                close(watched[i].fd);
                watched[i].fd = -1;
            }
    }
    for (int i = 0; i <= CLIENTS; i++)
        if (watched[i].fd >= 0)
            close(watched[i].fd);
    if (map)
        modbus_mapping_free(map);
    if (modbus) {
        modbus_set_socket(modbus, -1);
        modbus_free(modbus);
    }
}
