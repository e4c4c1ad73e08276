/* The drive: CiA 402 states, arming and executing, limits, watchdog, the writer's lock. */
#include "controller.h"

#include <math.h>
#include <string.h>

static const double RATED_kN = 650.0, RATED_MM = 250.0, RATED_MM_PER_S = 800.0, RATED_HZ = 5.0;
static const double FALL_BACK_MM_PER_S = 20.0, WRITER_FORGOTTEN_S = 10.0;
enum { OFF = 0x40, READY = 0x21, SWITCHED_ON = 0x23, ENABLED = 0x27, FAULT_REACTION = 0x0F, FAULT = 0x08 };
enum { FAULT_WATCHDOG = 1, FAULT_FORCE = 2, FAULT_STROKE = 3 };
enum { ACCEPTED, UNKNOWN, WRONG_STATE, OUT_OF_RANGE, NOT_ARMED };

bool drive_on(const struct device *d)
{
    return d->drive == ENABLED || d->drive == FAULT_REACTION;
}

static void publish(struct device *d);

void drive_boot(struct device *d)
{
    memset(d->image, 0, sizeof d->image);
    memset(&d->status, 0, sizeof d->status);
    memset(&d->motion, 0, sizeof d->motion);
    memset(&d->armed, 0, sizeof d->armed);
    d->queued = 0;
    d->drive = OFF;
    d->machine.valve_open = false;
    d->control = d->fault = d->echo = d->reject = d->done = d->reason = d->watchdog_trips = 0;
    d->moving = d->armed_good = d->executed = false;
    d->ring.made = d->sequence = 0;
    d->ring.overruns = 0;
    d->clock_s = d->fed_s = d->writer_s = 0.0;
    put_float(d->image + FORCE_LIMIT, (float)RATED_kN);
    put_float(d->image + STROKE_LIMIT, (float)RATED_MM);
    publish(d);
}

static void valve(struct device *d, bool open)
{
    if (d->machine.valve_open != open)
        say(d, open ? "valve-on" : "valve-off", "\"force_kN\": %.3f", d->machine.force_kN);
    d->machine.valve_open = open;
    if (open)
        d->motion.command_mm = d->machine.position_mm; /* it holds where it stands */
}

static void end_motion(struct device *d, int reason)
{
    if (d->moving && d->motion.order.sequence) {
        d->done = d->motion.order.sequence;
        d->reason = (uint16_t)reason;
        say(d, "end", "\"sequence\": %d, \"reason\": %d", d->done, reason);
    }
    d->moving = false;
}

static void give_up(struct device *d, int fault, int reason)
{
    say(d, "fault", "\"code\": %d, \"force_kN\": %.3f", fault, d->machine.force_kN);
    end_motion(d, reason);
    d->fault = (uint16_t)fault;
    if (fault == FAULT_WATCHDOG)
        d->watchdog_trips++;
    d->drive = FAULT_REACTION;
    struct order fall_back = {.code = RELEASE, .speed = (float)FALL_BACK_MM_PER_S};
    motion_begin(&d->motion, &fall_back); /* by itself: sequence 0 is nobody's command */
    d->moving = true;
}

/* ---- commands */
static bool between(float value, double low, double high)
{
    return isfinite(value) && value >= low && value <= high;
}

static int judged(const struct device *d, const struct order *o)
{
    double reach = get_float(d->image + STROKE_LIMIT), force = get_float(d->image + FORCE_LIMIT);
    if (o->code < HOLD || o->code > RELEASE)
        return UNKNOWN;
    if (d->drive != ENABLED || (d->moving && o->code != HOLD && o->code != RELEASE))
        return WRONG_STATE;
    bool good = true;
    switch (o->code) {
    case RAMP:
        good = between(o->target, -20.0, reach) && between(o->speed, 1e-3, RATED_MM_PER_S);
        break;
    case HARMONIC:
        good = between(o->mean, 0.0, reach) && between(o->amplitude, 1e-3, fmin(o->mean + 0.5, reach - o->mean)) &&
               between(o->frequency, 1e-3, RATED_HZ) && o->cycles >= 1 && o->cycles < 1000000 &&
               2.0 * M_PI * o->frequency * o->amplitude <= RATED_MM_PER_S;
        if (good && fabs(d->motion.command_mm - o->mean) > 0.5)
            return WRONG_STATE;
        break;
    case STATIC:
        good = between(o->speed, 1e-3, RATED_MM_PER_S) && between(o->turning_force, 0.05, force) &&
               between(o->turning_stroke, 0.1, reach) && between(o->pause, 0.0, 86400.0) && o->cycles >= 1;
        if (good && fabs(d->motion.command_mm) > 1.0)
            return WRONG_STATE;
        break;
    case RELEASE:
        good = between(o->speed, 1e-3, RATED_MM_PER_S);
        break;
    default:
        break;
    }
    return good ? ACCEPTED : OUT_OF_RANGE;
}

static void arm(struct device *d, const struct order *o)
{
    if (o->sequence == 0 || (d->executed && o->sequence == d->armed.sequence))
        return; /* no command; or one that was done already */
    d->armed = *o;
    d->executed = false;
    d->echo = o->sequence;
    d->reject = (uint16_t)judged(d, o);
    d->armed_good = d->reject == ACCEPTED;
    say(d, "armed", "\"sequence\": %d, \"code\": %d, \"reject\": %d", o->sequence, o->code, d->reject);
}

static void execute(struct device *d, uint16_t sequence)
{
    if (sequence == 0 || (d->executed && sequence == d->armed.sequence))
        return;
    d->echo = sequence;
    if (sequence != d->armed.sequence || !d->armed_good) {
        d->reject = NOT_ARMED;
        return;
    }
    d->reject = (uint16_t)judged(d, &d->armed);
    if (d->reject != ACCEPTED)
        return;
    end_motion(d, BY_COMMAND);
    d->executed = true;
    motion_begin(&d->motion, &d->armed);
    d->moving = true;
    say(d, "started", "\"sequence\": %d, \"code\": %d", sequence, d->armed.code);
}

/* ---- CiA 402 */
static void control(struct device *d, uint16_t word)
{
    bool reset = (word & 0x80) && !(d->control & 0x80);
    d->control = word;
    if (d->drive == FAULT && reset) {
        d->drive = OFF;
        d->fault = 0;
        say(d, "reset", "\"word\": %d", word);
        return;
    }
    if (d->drive == FAULT)
        return;
    int low = word & 0x0F, before = d->drive;
    if (!(low & 0x02) || !(low & 0x04))
        d->drive = d->drive == FAULT_REACTION ? FAULT : OFF; /* no voltage, or quick stop: off */
    else if (d->drive == FAULT_REACTION)
        return;
    else if (low == 0x06)
        d->drive = READY;
    else if (low == 0x07 && d->drive != OFF)
        d->drive = SWITCHED_ON;
    else if (low == 0x0F && d->drive != OFF)
        d->drive = ENABLED;
    if (drive_on(d) != (before == ENABLED || before == FAULT_REACTION)) {
        if (!drive_on(d))
            end_motion(d, BY_COMMAND);
        valve(d, drive_on(d));
    }
}

/* ---- the scan: take what is pending, publish */
static void publish(struct device *d)
{
    struct status *s = &d->status;
    uint16_t limit_ms = d->image[WATCHDOG];
    double left_ms = limit_ms - 1e3 * (d->clock_s - d->fed_s);
    s->word = (uint16_t)(d->drive | 0x10 | 0x20 | 0x200 | (d->drive == ENABLED && !d->moving ? 0x400 : 0));
    if (d->drive == OFF || d->drive == FAULT || d->drive == FAULT_REACTION)
        s->word &= (uint16_t)~0x20; /* bit 5 is part of the state's pattern here */
    s->state = d->drive == FAULT            ? 6
               : d->drive == FAULT_REACTION ? 5
               : d->drive == OFF            ? 0
               : d->drive != ENABLED        ? 1
               : !d->moving                 ? 2
               : d->motion.order.code == RAMP    ? 3
               : d->motion.order.code == RELEASE ? 5
               : d->motion.order.code == HOLD    ? 2
                                                 : 4;
    s->fault = d->fault;
    s->echo = d->echo;
    s->reject = d->reject;
    s->done = d->done;
    s->reason = d->reason;
    s->cycles = d->motion.cycles_done;
    s->heartbeat = (uint16_t)(uint64_t)(d->clock_s * 100.0);
    s->remaining = (uint16_t)fmax(0.0, fmin(left_ms, limit_ms));
    s->trips = d->watchdog_trips;
    s->force = (float)d->machine.measured_kN;
    s->stroke = (float)d->machine.stroke_mm;
    s->position = (float)d->machine.position_mm;
    s->command = (float)d->motion.command_mm;
    s->tick_us = (uint32_t)(uint64_t)llrint(d->clock_s * 1e6) + d->options->tick_start_us;
    s->made = d->ring.made;
    d->edges++;
    pthread_cond_broadcast(&d->edge);
}

void drive_scan(struct device *d)
{
    for (int i = 0; i < d->queued; i++) {
        const struct pending *p = &d->queue[i];
        if (p->kind == BLOCK)
            arm(d, &p->order);
        else if (p->kind == EXECUTE)
            execute(d, p->word);
        else
            control(d, p->word);
    }
    d->queued = 0;
    publish(d);
}

void drive_step(struct device *d, double dt_s)
{
    d->clock_s += dt_s;
    if (d->image[WRITER] && d->clock_s - d->writer_s > WRITER_FORGOTTEN_S) {
        say(d, "writer-forgotten", "\"number\": %d", d->image[WRITER]);
        d->image[WRITER] = 0;
    }
    if (d->drive == ENABLED && d->image[WATCHDOG] && 1e3 * (d->clock_s - d->fed_s) > d->image[WATCHDOG])
        give_up(d, FAULT_WATCHDOG, BY_WATCHDOG);
    if (drive_on(d) && d->moving) {
        int ended = motion_step(&d->motion, dt_s, d->machine.position_mm, d->machine.measured_kN);
        if (ended && d->drive == FAULT_REACTION) {
            d->moving = false;
            d->drive = FAULT;
            valve(d, false);
        } else if (ended) {
            end_motion(d, ended);
        }
    }
    machine_step(&d->machine, d->motion.command_mm, dt_s);
    if (d->drive == ENABLED) {
        if (d->machine.measured_kN > 1.02 * get_float(d->image + FORCE_LIMIT) + 1.0)
            give_up(d, FAULT_FORCE, BY_LIMIT);
        else if (d->machine.position_mm > get_float(d->image + STROKE_LIMIT) + 1.0)
            give_up(d, FAULT_STROKE, BY_LIMIT);
    }
}

/* ---- a write that registers_may_write allowed */
static void enqueue(struct device *d, struct pending p)
{
    if (d->queued < (int)(sizeof d->queue / sizeof *d->queue))
        d->queue[d->queued++] = p;
}

static struct order order_in(const uint16_t *r)
{
    return (struct order){.sequence = r[0], .code = r[1], .target = get_float(r + 2), .speed = get_float(r + 4),
                          .mean = get_float(r + 6), .amplitude = get_float(r + 8), .frequency = get_float(r + 10),
                          .cycles = get32(r + 12), .turning_force = get_float(r + 14),
                          .turning_stroke = get_float(r + 16), .pause = get_float(r + 18)};
}

void drive_write(struct device *d, int address, int n, const uint16_t *values)
{
    uint16_t fed = d->image[FEED], writer = d->image[WRITER];
    memcpy(d->image + address, values, sizeof(uint16_t) * (size_t)n);
    if (address <= BLOCK && address + n >= BLOCK_END)
        enqueue(d, (struct pending){.kind = BLOCK, .order = order_in(d->image + BLOCK)});
    if (address <= EXECUTE && EXECUTE < address + n)
        enqueue(d, (struct pending){.kind = EXECUTE, .word = d->image[EXECUTE]});
    if (address <= CONTROL && CONTROL < address + n)
        enqueue(d, (struct pending){.kind = CONTROL, .word = d->image[CONTROL]});
    if (d->image[FEED] != fed)
        d->fed_s = d->writer_s = d->clock_s;
    if (address <= WRITER && WRITER < address + n && d->image[WRITER])
        d->writer_s = d->clock_s;
    if (d->image[WRITER] != writer) {
        say(d, "writer", "\"number\": %d", d->image[WRITER]);
    }
}
