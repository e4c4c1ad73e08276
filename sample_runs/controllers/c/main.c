/* The controller as a program: a thread that controls, and one that answers.
 *
 *     controller [--address 127.0.0.1] [--port 502] [--unit 1] [--serial 1]
 *
 * Prints "ready PORT". Ends by SIGTERM or SIGINT, valve closed.
 */
#define _GNU_SOURCE
#include "controller.h"
#include "server.h"
#include "settings.h"

#include <getopt.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static volatile sig_atomic_t stop;
static pthread_mutex_t lock;
static struct controller controller;

static void on_signal(int number)
{
    (void)number;
    stop = 1;
}

static void *control(void *nothing)
{
    while (!stop) {
        struct inputs inputs;
        bool good = hal_sample(&inputs);
        pthread_mutex_lock(&lock);
        struct outputs outputs = controller_cycle(&controller, &inputs, good);
        pthread_mutex_unlock(&lock);
        hal_drive(&outputs);
    }
    return nothing;
}

static int exchange(void *device, int write_at, int write_count, const uint16_t *written, int read_at, int read_count,
                    uint16_t *read)
{
    enum exception refused = GRANTED;
    pthread_mutex_lock(&lock);
    if (read_count && !may_read(read_at, read_count))
        refused = ILLEGAL_ADDRESS; /* before anything is written */
    if (!refused && write_count)
        refused = controller_write(device, write_at, write_count, written);
    if (!refused && read_count)
        refused = controller_read(device, read_at, read_count, read);
    pthread_mutex_unlock(&lock);
    return (int)refused;
}

/* The thread that controls must not wait behind one that only answers and was itself put aside. */
static void make_lock(void)
{
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&lock, &attributes);
    pthread_mutexattr_destroy(&attributes);
}

struct options {
    const char *address;
    long port, unit;
    unsigned long serial;
};

static long number_in(const char *text, const char *what, long most)
{
    char *end;
    long number = strtol(text, &end, 10);
    if (*text == '\0' || *end != '\0' || number < 0 || number > most) {
        fprintf(stderr, "controller: %s must be a whole number from 0 to %ld, not '%s'\n", what, most, text);
        exit(2);
    }
    return number;
}

static struct options parse(int argc, char **argv)
{
    static const struct option words[] = {
        {"address", 1, NULL, 'a'}, {"port", 1, NULL, 'p'}, {"unit", 1, NULL, 'u'}, {"serial", 1, NULL, 's'}, {0}};
    struct options options = {.address = "127.0.0.1", .port = 502, .unit = 1, .serial = 1};
    for (int word; (word = getopt_long(argc, argv, "", words, NULL)) != -1;)
        switch (word) {
        case 'a': options.address = optarg; break;
        case 'p': options.port = number_in(optarg, "--port", 65535); break;
        case 'u': options.unit = number_in(optarg, "--unit", 247); break;
        case 's': options.serial = (unsigned long)number_in(optarg, "--serial", 4294967295L); break;
        default: exit(2);
        }
    if (optind < argc) {
        fprintf(stderr, "controller: unexpected '%s'\n", argv[optind]);
        exit(2);
    }
    return options;
}

int main(int argc, char **argv)
{
    struct options options = parse(argc, argv);
    struct sigaction action = {.sa_handler = on_signal};
    const struct served served = {.device = &controller, .exchange = exchange, .registers = REGISTERS};
    pthread_t thread;
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    action.sa_handler = SIG_IGN; /* a client that goes away is no reason to end */
    sigaction(SIGPIPE, &action, NULL);
    int port = server_open(options.address, (int)options.port);
    if (port < 0) {
        fprintf(stderr, "controller: cannot listen at %s port %ld: ", options.address, options.port);
        perror("");
        return 1;
    }
    controller_start(&controller, (uint32_t)options.serial);
    make_lock();
    if (hal_open(RATE_HZ)) {
        perror("controller: the hardware");
        return 1;
    }
    int failed = pthread_create(&thread, NULL, control, NULL);
    if (failed) {
        fprintf(stderr, "controller: no thread to control with: %s\n", strerror(failed));
        hal_close();
        return 1;
    }
    printf("ready %d\n", port);
    fflush(stdout);
    server_run(&served, (int)options.unit, &stop);
    pthread_join(thread, NULL);
    hal_close();
    return 0;
}
