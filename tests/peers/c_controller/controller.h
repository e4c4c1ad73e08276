/* A ring controller written from docs/drivers.md and drivers/register_maps/profiles/ring.toml alone: what its parts share.
 *
 * One thread controls (a sample each period of the device's own clock), one answers Modbus. What both touch is
 * guarded by the device's mutex. Lengths in mm, forces in kN, times in s of the device unless a name says otherwise.
 */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* What the command line asks for. */
struct options {
    int port;                /* Modbus TCP, 0: any free one; -1: none */
    const char *pty;         /* RTU on a pseudo-terminal that is linked here */
    int baud;                /* the line time that a reply on the pseudo-terminal takes */
    int unit;
    double rate_Hz;          /* samples a second of device time */
    double ppm;              /* the device's clock runs so much fast */
    uint32_t tick_start_us;
    double delay_ms, jitter_ms; /* a reply is held so long, and up to so much longer */
    double scan_ms;          /* registers and ring are published, commands taken, only so often; 0: each sample */
    bool reply_at_edge;      /* requests, too, are answered at the edge of the scan only */
    bool no_fc23;
    long miss_every;         /* a control cycle is missed after so many samples; 0: never */
    bool miss_leaves_hole;   /* the missed cycle's sequence number is missing, too */
    long ring_size;          /* samples held */
    long late_every, cut_every; /* each so many-th reply is late by late_ms, or cut in two */
    double late_ms, boot_s;
    uint32_t serial;
    unsigned seed;
    const char *truth, *log;
};

/* ---- the machine: piston, frame, specimen (machine.c) */
struct machine {
    double position_mm, valve_mm_per_s; /* piston, and the speed that the valve lets it have */
    double friction;                    /* state of the hysteresis, -1 on the unloading branch ... 1 on the loading one */
    double stroke_mm, force_kN;         /* of the specimen */
    double measured_kN;                 /* through the transducer's filter: what the device acts on */
    double drift_kN;                    /* coloured noise */
    uint64_t random;
    bool valve_open;
};
void machine_start(struct machine *m, unsigned seed);
void machine_step(struct machine *m, double command_mm, double dt_s);
double machine_noise(struct machine *m); /* standard normal */

/* ---- motions (motion.c) */
enum { HOLD = 1, RAMP = 2, HARMONIC = 3, STATIC = 4, RELEASE = 5 };
enum { BY_TARGET = 1, BY_FORCE = 2, BY_COMMAND = 3, BY_WATCHDOG = 4, BY_LIMIT = 5 };

struct order { /* the command block as it was armed */
    uint16_t sequence, code;
    float target, speed, mean, amplitude, frequency;
    uint32_t cycles;
    float turning_force, turning_stroke, pause;
};
struct motion {
    struct order order;
    int phase;            /* of a static cycle; of a hold: 1 while it brakes */
    double time_s;        /* since it began */
    double command_mm, speed_mm_per_s, braking_mm_per_s2;
    uint32_t cycles_done;
    int turned_by;
};
void motion_begin(struct motion *m, const struct order *order);
/* Moves the set point by one period; returns 0 while it goes on, else the reason of its end. */
int motion_step(struct motion *m, double dt_s, double position_mm, double force_kN);

/* ---- samples (samples.c) */
struct sample {
    uint64_t sequence; /* not wrapped; the wire has its lower half */
    uint32_t tick_us;
    int32_t force;
    uint16_t stroke_1, stroke_2;
    int16_t position, command;
};
struct ring {
    struct sample *held;
    long size;
    uint64_t made; /* samples made since boot: held[i % size] for the last `size` of them */
    uint16_t overruns;
};

/* ---- the drive: CiA 402, commands, watchdog, writer (drive.c) */
enum { NOTHING, RELEASING, STOPPED_BY_FAULT };
enum { IMAGE = 400, BLOCK = 64, BLOCK_END = 84, EXECUTE = 84, CONTROL = 96, FEED = 97, WATCHDOG = 98, REQUEST = 99,
       FORCE_LIMIT = 100, STROKE_LIMIT = 102, WRITER = 104, ACKNOWLEDGE = 256, WINDOW = 260, WINDOW_END = 381 };
struct pending { /* what a request left for the next scan */
    int kind; /* BLOCK, EXECUTE or CONTROL */
    uint16_t word;
    struct order order;
};
struct status { /* as it is published at the edge of a scan */
    uint16_t word, state, fault, echo, reject, done, heartbeat, remaining, trips, reason;
    uint32_t cycles, tick_us;
    float force, stroke, position, command;
    uint64_t made;
};
struct device {
    const struct options *options;
    pthread_mutex_t lock;
    pthread_cond_t edge;
    uint64_t edges;
    struct machine machine;
    struct motion motion;
    struct ring ring;
    struct status status;
    uint16_t image[IMAGE]; /* holding registers as written */
    struct pending queue[64];
    int queued;
    /* CiA 402 and commands */
    int drive;        /* status word's low bits of the state: 0x40, 0x21, 0x23, 0x27, 0x0F, 0x08 */
    uint16_t control, fault;
    bool moving, armed_good, executed;
    struct order armed;
    uint16_t echo, reject, done, reason, watchdog_trips;
    double clock_s, fed_s, writer_s; /* device time now, and of the last feed and sign of the writer */
    uint64_t sequence;
    uint16_t boot;
    FILE *truth;
    uint64_t produced, missed;
    bool down; /* it boots: deaf and dumb */
};
void drive_boot(struct device *d);
void drive_scan(struct device *d);                /* takes what is pending and publishes */
void drive_step(struct device *d, double dt_s);   /* one control cycle */
void drive_write(struct device *d, int address, int n, const uint16_t *values); /* a checked write */
bool drive_on(const struct device *d);
double device_now_s(const struct device *d);

void samples_take(struct device *d);
int samples_window(struct device *d, uint32_t asked, uint64_t made, uint16_t status_word, uint16_t *window, int room);

/* ---- registers (registers.c) */
uint32_t crc32_of(const uint16_t *registers, int n, uint32_t crc);
void put32(uint16_t *at, uint32_t value);
void put_float(uint16_t *at, float value);
uint32_t get32(const uint16_t *at);
float get_float(const uint16_t *at);
void registers_read(struct device *d, int address, int n, uint16_t *into);
int registers_may_read(int address, int n);
int registers_may_write(struct device *d, int address, int n, const uint16_t *values); /* 0 or a Modbus exception */

/* ---- wire.c, main.c */
int wire_open(struct device *d);
void wire_serve(struct device *d, volatile int *stop, volatile int *restart);
void say(struct device *d, const char *event, const char *format, ...) __attribute__((format(printf, 3, 4)));
double monotonic_s(void);
void sleep_until_s(double when_s);
#endif
