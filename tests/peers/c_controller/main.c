/* A ring controller on libmodbus, for trying bufferstand against something that its authors did not write.
 *
 * Prints "ready PORT" when it can be reached. Ends when its standard input does, or by SIGTERM. SIGUSR1 boots it anew.
 */
#define _GNU_SOURCE
#include "controller.h"

#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static volatile int stop, restart;
static FILE *journal;

double monotonic_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void sleep_until_s(double when_s)
{
    struct timespec t = {.tv_sec = (time_t)when_s, .tv_nsec = (long)(1e9 * (when_s - floor(when_s)))};
    if (when_s > monotonic_s())
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) && !stop)
            ;
}

void say(struct device *d, const char *event, const char *format, ...)
{
    va_list arguments;
    if (!journal)
        return;
    fprintf(journal, "{\"event\": \"%s\", \"monotonic_s\": %.6f, \"clock_s\": %.6f, ", event, monotonic_s(), d->clock_s);
    va_start(arguments, format);
    vfprintf(journal, format, arguments);
    va_end(arguments);
    fputs("}\n", journal);
    fflush(journal);
}

static void *control_loop(void *of)
{
    struct device *d = of;
    const struct options *o = d->options;
    double period = 1.0 / o->rate_Hz, began = monotonic_s(), rate = 1.0 + 1e-6 * o->ppm;
    long since_miss = 0, scans = 0, unflushed = 0;
    uint16_t boot = d->boot;
    while (!stop) {
        sleep_until_s(began + (d->clock_s + period) / rate);
        pthread_mutex_lock(&d->lock);
        if (d->boot != boot) { /* its clock began anew */
            boot = d->boot;
            began = monotonic_s();
            scans = since_miss = 0;
        }
        if (d->down) {
            machine_step(&d->machine, 0.0, period); /* the closed valve leaks */
            d->clock_s += period;
        } else {
            bool misses = o->miss_every && ++since_miss >= o->miss_every;
            drive_step(d, misses ? 2.0 * period : period);
            if (misses) {
                since_miss = 0;
                d->missed++;
                d->sequence += o->miss_leaves_hole ? 1 : 0;
            }
            samples_take(d);
            d->sequence++;
            long scan = o->scan_ms > 0.0 ? (long)(1e3 * d->clock_s / o->scan_ms) : scans + 1;
            if (scan != scans)
                drive_scan(d);
            scans = scan;
            if (d->truth && ++unflushed >= 100) {
                fflush(d->truth);
                unflushed = 0;
            }
        }
        pthread_mutex_unlock(&d->lock);
    }
    return NULL;
}

static void on_signal(int number)
{
    if (number == SIGUSR1)
        restart = 1;
    else
        stop = 1;
}

enum { PORT = 256, PTY, BAUD, UNIT, RATE, PPM, TICK, DELAY, JITTER, SCAN, EDGE, NO_FC23, MISS, HOLE, RING, LATE_EVERY,
       LATE_MS, CUT, BOOT, SERIAL, SEED, TRUTH, LOG };
static const struct option words[] = {
    {"port", 1, 0, PORT}, {"pty", 1, 0, PTY}, {"baud", 1, 0, BAUD}, {"unit", 1, 0, UNIT}, {"rate-hz", 1, 0, RATE},
    {"ppm", 1, 0, PPM}, {"tick-start-us", 1, 0, TICK}, {"delay-ms", 1, 0, DELAY}, {"jitter-ms", 1, 0, JITTER},
    {"scan-ms", 1, 0, SCAN}, {"reply-at-edge", 0, 0, EDGE}, {"no-fc23", 0, 0, NO_FC23}, {"miss-every", 1, 0, MISS},
    {"miss-leaves-hole", 0, 0, HOLE}, {"ring", 1, 0, RING}, {"late-every", 1, 0, LATE_EVERY}, {"late-ms", 1, 0, LATE_MS},
    {"cut-every", 1, 0, CUT}, {"boot-s", 1, 0, BOOT}, {"serial", 1, 0, SERIAL}, {"seed", 1, 0, SEED},
    {"truth", 1, 0, TRUTH}, {"log", 1, 0, LOG}, {0}};

static struct options parse(int argc, char **argv)
{
    struct options o = {.baud = 115200, .unit = 1, .rate_Hz = 1000.0, .ring_size = 65536, .boot_s = 1.0, .serial = 7001,
                        .late_ms = 1000.0, .seed = 1};
    for (int word; (word = getopt_long(argc, argv, "", words, NULL)) != -1;)
        switch (word) {
        case PORT: o.port = atoi(optarg); break;
        case PTY: o.pty = optarg; break;
        case BAUD: o.baud = atoi(optarg); break;
        case UNIT: o.unit = atoi(optarg); break;
        case RATE: o.rate_Hz = atof(optarg); break;
        case PPM: o.ppm = atof(optarg); break;
        case TICK: o.tick_start_us = (uint32_t)strtoul(optarg, NULL, 0); break;
        case DELAY: o.delay_ms = atof(optarg); break;
        case JITTER: o.jitter_ms = atof(optarg); break;
        case SCAN: o.scan_ms = atof(optarg); break;
        case EDGE: o.reply_at_edge = true; break;
        case NO_FC23: o.no_fc23 = true; break;
        case MISS: o.miss_every = atol(optarg); break;
        case HOLE: o.miss_leaves_hole = true; break;
        case RING: o.ring_size = atol(optarg); break;
        case LATE_EVERY: o.late_every = atol(optarg); break;
        case LATE_MS: o.late_ms = atof(optarg); break;
        case CUT: o.cut_every = atol(optarg); break;
        case BOOT: o.boot_s = atof(optarg); break;
        case SERIAL: o.serial = (uint32_t)atol(optarg); break;
        case SEED: o.seed = (unsigned)atol(optarg); break;
        case TRUTH: o.truth = optarg; break;
        case LOG: o.log = optarg; break;
        default: exit(2);
        }
    return o;
}

int main(int argc, char **argv)
{
    struct options options = parse(argc, argv);
    struct device device = {.options = &options};
    struct sigaction action = {.sa_handler = on_signal};
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGUSR1, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    device.ring.size = options.ring_size;
    device.ring.held = calloc((size_t)options.ring_size, sizeof *device.ring.held);
    device.truth = options.truth ? fopen(options.truth, "wb") : NULL;
    journal = options.log ? fopen(options.log, "w") : NULL;
    if (!device.ring.held || (options.truth && !device.truth) || (options.log && !journal))
        return perror("controller"), 1;
    pthread_mutex_init(&device.lock, NULL);
    pthread_cond_init(&device.edge, NULL);
    machine_start(&device.machine, options.seed);
    drive_boot(&device);
    int port = wire_open(&device);
    if (port < 0)
        return perror("controller"), 1;
    pthread_t loop;
    pthread_create(&loop, NULL, control_loop, &device);
    printf("ready %d\n", port);
    fflush(stdout);
    wire_serve(&device, &stop, &restart);
    stop = 1;
    pthread_join(loop, NULL);
    if (options.pty)
        unlink(options.pty);
    if (device.truth)
        fclose(device.truth);
    say(&device, "bye", "\"produced\": %llu, \"missed\": %llu, \"force_kN\": %.3f, \"position_mm\": %.3f, \"valve\": %s",
        (unsigned long long)device.produced, (unsigned long long)device.missed, device.machine.force_kN,
        device.machine.position_mm, device.machine.valve_open ? "true" : "false");
    return 0;
}
