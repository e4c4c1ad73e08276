/* Modbus TCP and RTU by libmodbus: FC3, FC6, FC16, FC23; one thread, so one reply that is held holds all. */
#define _GNU_SOURCE
#include "controller.h"

#include <errno.h>
#include <fcntl.h>
#include <modbus.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

enum { CLIENTS = 16 };
struct wire {
    modbus_t *modbus;
    modbus_mapping_t *map;
    int listener, clients[CLIENTS];
    int master, slave; /* of the pseudo-terminal; the slave is kept open, so that a client may come and go */
    long answered;
    unsigned seed;
};
static struct wire wire = {.listener = -1, .master = -1, .slave = -1};

static int open_tcp(struct device *d)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)d->options->port),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof address;
    int yes = 1;
    wire.listener = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(wire.listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (bind(wire.listener, (struct sockaddr *)&address, length) || listen(wire.listener, 5) ||
        getsockname(wire.listener, (struct sockaddr *)&address, &length))
        return -1;
    return ntohs(address.sin_port);
}

static int open_pty(struct device *d)
{
    struct termios raw;
    wire.master = posix_openpt(O_RDWR | O_NOCTTY);
    if (wire.master < 0 || grantpt(wire.master) || unlockpt(wire.master))
        return -1;
    const char *path = ptsname(wire.master);
    wire.slave = open(path, O_RDWR | O_NOCTTY);
    if (wire.slave < 0 || tcgetattr(wire.slave, &raw))
        return -1;
    cfmakeraw(&raw);
    tcsetattr(wire.slave, TCSANOW, &raw);
    unlink(d->options->pty);
    return symlink(path, d->options->pty);
}

int wire_open(struct device *d)
{
    for (int i = 0; i < CLIENTS; i++)
        wire.clients[i] = -1;
    if (!wire.modbus) {
        wire.seed = d->options->seed + 1;
        wire.map = modbus_mapping_new(0, 0, IMAGE, 0);
        wire.modbus = d->options->pty ? modbus_new_rtu(d->options->pty, d->options->baud, 'E', 8, 1)
                                      : modbus_new_tcp("127.0.0.1", d->options->port);
        modbus_set_slave(wire.modbus, d->options->unit);
    }
    if (!d->options->pty)
        return open_tcp(d);
    return open_pty(d);
}

static void close_all(void)
{
    for (int i = 0; i < CLIENTS; i++)
        if (wire.clients[i] >= 0)
            close(wire.clients[i]);
    close(wire.listener);
    wire.listener = -1;
    if (wire.master >= 0) {
        close(wire.slave);
        close(wire.master);
        wire.master = wire.slave = -1;
    }
}

/* What a request wants; 0, or the Modbus exception that answers it. */
struct request {
    int function, read, n_read, write, n_write;
    uint16_t values[125];
};

static int parse(const struct device *d, const uint8_t *pdu, struct request *r)
{
    const uint8_t *data = NULL;
#define WORD(i) (pdu[i] << 8 | pdu[(i) + 1])
    *r = (struct request){.function = pdu[0]};
    switch (pdu[0]) {
    case 3:
        r->read = WORD(1), r->n_read = WORD(3);
        break;
    case 6:
        r->write = WORD(1), r->n_write = 1, data = pdu + 3;
        break;
    case 16:
        r->write = WORD(1), r->n_write = WORD(3), data = pdu + 6;
        break;
    case 23:
        if (d->options->no_fc23)
            return 1;
        r->read = WORD(1), r->n_read = WORD(3), r->write = WORD(5), r->n_write = WORD(7), data = pdu + 10;
        break;
    default:
        return 1;
    }
    if (r->n_read > 125 || r->n_write > 123 || (pdu[0] != 6 && pdu[0] != 16 && !r->n_read) || (data && !r->n_write))
        return 3;
    for (int i = 0; data && i < r->n_write; i++)
        r->values[i] = (uint16_t)(data[2 * i] << 8 | data[2 * i + 1]);
#undef WORD
    return 0;
}

static int carry_out(struct device *d, struct request *r)
{
    int refused = 0;
    pthread_mutex_lock(&d->lock);
    if (r->n_read)
        refused = registers_may_read(r->read, r->n_read);
    if (!refused && r->n_write)
        refused = registers_may_write(d, r->write, r->n_write, r->values);
    if (!refused && r->n_write) {
        drive_write(d, r->write, r->n_write, r->values);
        if (d->options->scan_ms <= 0.0)
            drive_scan(d); /* without a scan a write acts at once */
    }
    if (!refused && d->options->reply_at_edge) {
        uint64_t edge = d->edges;
        while (d->edges == edge && !d->down)
            pthread_cond_wait(&d->edge, &d->lock);
    }
    if (!refused && r->n_read)
        registers_read(d, r->read, r->n_read, wire.map->tab_registers + r->read);
    pthread_mutex_unlock(&d->lock);
    return refused;
}

static double line_time_s(const struct device *d, int bytes)
{
    return d->options->pty ? (bytes + 3.5) * 11.0 / d->options->baud : 0.0;
}

/* Half a reply: a length that promises more than comes. Then the connection ends; a line falls silent. */
static void cut(int fd, const uint8_t *query, const struct request *r, bool tcp)
{
    uint8_t half[24] = {0};
    int length = 2 * r->n_read + 3;
    if (tcp) {
        memcpy(half, query, 4);
        half[4] = (uint8_t)(length >> 8), half[5] = (uint8_t)length;
        half[6] = query[6], half[7] = (uint8_t)r->function, half[8] = (uint8_t)(2 * r->n_read);
    } else {
        half[0] = query[0], half[1] = (uint8_t)r->function, half[2] = (uint8_t)(2 * r->n_read);
    }
    if (write(fd, half, sizeof half) < 0)
        return;
}

static bool answer(struct device *d, int fd)
{
    const struct options *o = d->options;
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    struct request request;
    modbus_set_socket(wire.modbus, fd);
    int length = modbus_receive(wire.modbus, query);
    if (length == 0)
        return true; /* for another unit of the line */
    if (length < 0)
        return !o->pty ? false : true;
    double came = monotonic_s();
    int header = modbus_get_header_length(wire.modbus);
    if (!o->pty && query[header - 1] != o->unit) {
        modbus_reply_exception(wire.modbus, query, MODBUS_EXCEPTION_GATEWAY_TARGET);
        return true;
    }
    sleep_until_s(came + line_time_s(d, length));
    int refused = parse(d, query + header, &request);
    if (!refused)
        refused = carry_out(d, &request);
    wire.answered++;
    double hold_ms = o->delay_ms + o->jitter_ms * rand_r(&wire.seed) / RAND_MAX;
    if (o->late_every && wire.answered % o->late_every == 0)
        hold_ms += o->late_ms;
    sleep_until_s(came + line_time_s(d, length) + 1e-3 * hold_ms +
                  line_time_s(d, request.n_read ? 2 * request.n_read + 5 : 8));
    if (o->cut_every && wire.answered % o->cut_every == 0) {
        cut(fd, query, &request, !o->pty);
        return o->pty != NULL;
    }
    if (refused)
        return modbus_reply_exception(wire.modbus, query, (unsigned)refused) > 0;
    return modbus_reply(wire.modbus, query, length, wire.map) > 0 || o->pty;
}

static void welcome(void)
{
    int yes = 1, fd = accept(wire.listener, NULL, NULL);
    for (int i = 0; fd >= 0 && i < CLIENTS; i++)
        if (wire.clients[i] < 0) {
            setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
            wire.clients[i] = fd;
            return;
        }
    if (fd >= 0)
        close(fd);
}

static void boot(struct device *d)
{
    pthread_mutex_lock(&d->lock);
    d->down = true; /* by this its control loop knows, too: nothing is sampled, the valve closes */
    say(d, "down", "\"force_kN\": %.3f", d->machine.force_kN);
    d->machine.valve_open = false;
    pthread_cond_broadcast(&d->edge);
    pthread_mutex_unlock(&d->lock);
    close_all();
    sleep_until_s(monotonic_s() + d->options->boot_s);
    pthread_mutex_lock(&d->lock);
    d->boot++;
    drive_boot(d);
    d->down = false;
    say(d, "boot", "\"number\": %d", d->boot);
    pthread_mutex_unlock(&d->lock);
    wire_open(d);
}

void wire_serve(struct device *d, volatile int *stop, volatile int *restart)
{
    while (!*stop) {
        fd_set ready;
        int top = 0;
        struct timeval patience = {.tv_usec = 100000};
        if (*restart) {
            *restart = 0;
            boot(d);
        }
        FD_ZERO(&ready);
        FD_SET(STDIN_FILENO, &ready); /* who started it holds the other end: it never outlives him */
        int watched[CLIENTS + 2], n = 0;
        if (wire.master >= 0)
            watched[n++] = wire.master;
        else
            watched[n++] = wire.listener;
        for (int i = 0; i < CLIENTS; i++)
            if (wire.clients[i] >= 0)
                watched[n++] = wire.clients[i];
        for (int i = 0; i < n; i++) {
            FD_SET(watched[i], &ready);
            top = watched[i] > top ? watched[i] : top;
        }
        if (select(top + 1, &ready, NULL, NULL, &patience) <= 0)
            continue;
        char unread[64];
        if (FD_ISSET(STDIN_FILENO, &ready) && read(STDIN_FILENO, unread, sizeof unread) <= 0)
            return;
        if (wire.master >= 0) {
            if (FD_ISSET(wire.master, &ready))
                answer(d, wire.master);
            continue;
        }
        if (FD_ISSET(wire.listener, &ready))
            welcome();
        for (int i = 0; i < CLIENTS; i++) {
            int fd = wire.clients[i];
            if (fd >= 0 && FD_ISSET(fd, &ready) && !answer(d, fd)) {
                close(fd);
                wire.clients[i] = -1;
            }
        }
    }
}
