/* Modbus TCP by libmodbus: functions 3, 6, 16 and 23, several clients, one request at a time. */
#ifndef SERVER_H
#define SERVER_H

#include <signal.h>
#include <stdint.h>

/* What a server asks; both return 0 or a Modbus exception. A request's writing comes before its reading. */
struct served {
    void *device;
    int (*exchange)(void *device, int write_at, int write_count, const uint16_t *written, int read_at, int read_count,
                    uint16_t *read);
    int registers; /* addresses end here */
};

/* Listens; returns the port (any free one for 0), or -1 with errno. */
int server_open(const char *address, int port);

/* Answers until *stop. */
void server_run(const struct served *served, int unit, volatile sig_atomic_t *stop);

#endif
