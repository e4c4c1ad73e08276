/* A PLC for a compiled ST program: one task, a Modbus server beside it, and the simulated machine of the controller
 * in C at its terminals.
 *
 * The server is as simple as those that PLCs come with: it reads and writes the program's registers between two scans,
 * and the program gets to know of it by looking. Function 23 it does not know.
 *
 *     plc [--port 502]        prints "ready PORT"
 */
#define _GNU_SOURCE
#include "plc.h"
#include "server.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REGISTERS = 400, ILLEGAL_FUNCTION = 1, RATE_HZ = 1000 };

static volatile sig_atomic_t stop;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static void on_signal(int number)
{
    (void)number;
    stop = 1;
}

static void *scan(void *nothing)
{
    while (!stop) {
        struct inputs inputs;
        int good = hal_sample(&inputs);
        pthread_mutex_lock(&lock);
        struct outputs outputs = plc_scan(&inputs, good);
        pthread_mutex_unlock(&lock);
        hal_drive(&outputs);
    }
    return nothing;
}

static int exchange(void *registers, int write_at, int write_count, const uint16_t *written, int read_at, int read_count,
                    uint16_t *read)
{
    uint16_t *image = registers;
    if (write_count && read_count)
        return ILLEGAL_FUNCTION;
    pthread_mutex_lock(&lock);
    memcpy(image + write_at, written, sizeof *written * (size_t)write_count);
    memcpy(read, image + read_at, sizeof *read * (size_t)read_count);
    pthread_mutex_unlock(&lock);
    return 0;
}

int main(int argc, char **argv)
{
    struct sigaction action = {.sa_handler = on_signal};
    pthread_t thread;
    struct inputs inputs;
    int port = argc == 3 && !strcmp(argv[1], "--port") ? atoi(argv[2]) : 502;
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
    port = server_open("127.0.0.1", port);
    if (port < 0 || hal_open(RATE_HZ)) {
        perror("plc");
        return 1;
    }
    plc_start();
    plc_scan(&inputs, hal_sample(&inputs)); /* its registers show what it is before anybody asks */
    const struct served served = {.device = plc_registers(), .exchange = exchange, .registers = REGISTERS};
    if (pthread_create(&thread, NULL, scan, NULL))
        return 1;
    printf("ready %d\n", port);
    fflush(stdout);
    server_run(&served, 1, &stop);
    pthread_join(thread, NULL);
    hal_close();
    return 0;
}
