/* Switching on and off, commands, limits, watchdog and the writer's lock. */
#include "controller.h"
#include "settings.h"

#include <math.h>
#include <string.h>

static const double TWO_PI = 6.283185307179586;
static const double SLACK = 1.0 + 1e-6; /* a limit of 32 bits may be rounded up */

static double in_s(uint64_t us)
{
    return 1e-6 * (double)us;
}

static bool is_on(const struct controller *c)
{
    return c->drive == DRIVE_ENABLED || c->drive == DRIVE_REACTS;
}

void controller_start(struct controller *c, uint32_t serial)
{
    memset(c, 0, sizeof *c);
    c->drive = DRIVE_OFF;
    c->image[DEVICE_TYPE] = 0x4253;
    c->image[PROFILE_VERSION] = 3;
    put_float(c->image + TEST_FLOAT, -1234.5f);
    put_u32(c->image + TEST_INTEGER, 0x12345678);
    put_u32(c->image + SERIAL, serial);
    put_float(c->image + SAMPLE_RATE, (float)RATE_HZ);
    c->image[SIMULATED] = hal_is_simulated() ? 0x5349 : 0;
    put_float(c->image + FORCE_LIMIT, (float)RATED_FORCE_KN);
    put_float(c->image + STROKE_LIMIT, (float)RATED_STROKE_MM);
}

/* ---- motions: how they begin and end */

static void motion_over(struct controller *c, enum reason reason)
{
    if (c->moving && c->motion.order.sequence) { /* number 0 is of its own accord */
        c->done = c->motion.order.sequence;
        c->reason = (uint16_t)reason;
    }
    c->moving = false;
}

static void begin(struct controller *c, const struct order *order)
{
    motion_over(c, COMMANDED);
    motion_begin(&c->motion, order);
    c->moving = true;
}

static void switch_valve(struct controller *c, bool open)
{
    if (open && !c->valve) { /* it holds where it stands, and is given the watchdog's whole time */
        c->motion.command_mm = c->measured.position_mm;
        c->motion.rate_mm_per_s = 0.0;
        c->fed_us = c->now_us;
    }
    if (!open)
        motion_over(c, COMMANDED);
    c->valve = open;
}

/* Gives up: the motion ends, the force goes to zero at its own speed, then the valve closes and the fault stands. */
static void give_up(struct controller *c, enum fault fault, enum reason reason)
{
    const struct order fall_back = {.code = RELEASE, .speed_mm_per_s = (float)FALL_BACK_MM_PER_S};
    motion_over(c, reason);
    c->fault = fault;
    c->drive = DRIVE_REACTS;
    begin(c, &fall_back);
}

/* ---- commands */

static bool between(double value, double low, double high)
{
    return isfinite(value) && value >= low && value <= high * SLACK;
}

static bool fits_sine(const struct controller *c, const struct order *o, double frequency_Hz)
{
    double reach_mm = get_float(c->image + STROKE_LIMIT);
    return between(o->mean_mm, 0.0, reach_mm) && o->amplitude_mm > 0.0 && between(o->amplitude_mm, 0.0, o->mean_mm) &&
           between(o->mean_mm + o->amplitude_mm, 0.0, reach_mm) &&
           between(TWO_PI * frequency_Hz * o->amplitude_mm, 0.0, RATED_SPEED_MM_PER_S);
}

/* |m'| + |A'| + w A bounds the speed on the way; half a cosine over a cycle changes at most pi/2 f times what it
 * bridges. */
static bool fits_change(const struct controller *c, const struct order *o)
{
    const struct motion *m = &c->motion;
    double f = m->order.frequency_Hz, bridged = fabs(o->mean_mm - m->mean_mm) + fabs(o->amplitude_mm - m->amplitude_mm);
    double top = TWO_PI * f * fmax(m->amplitude_mm, o->amplitude_mm) + 0.25 * TWO_PI * f * bridged;
    return fits_sine(c, o, f) && between(top, 0.0, RATED_SPEED_MM_PER_S);
}

static bool fits(const struct controller *c, const struct order *o)
{
    double force_kN = get_float(c->image + FORCE_LIMIT), reach_mm = get_float(c->image + STROKE_LIMIT);
    bool speed = o->speed_mm_per_s > 0.0f && between(o->speed_mm_per_s, 0.0, RATED_SPEED_MM_PER_S);
    switch (o->code) {
    case RAMP:
        return speed && between(o->target_mm, RETRACTED_MM, reach_mm);
    case HARMONIC:
        return fits_sine(c, o, o->frequency_Hz) && o->frequency_Hz > 0.0f &&
               between(o->frequency_Hz, 0.0, RATED_FREQUENCY_HZ) && o->cycles >= 1;
    case STATIC:
        return speed && o->turning_force_kN > 0.0f && between(o->turning_force_kN, 0.0, force_kN) &&
               o->turning_stroke_mm > 0.0f && between(o->turning_stroke_mm, 0.0, reach_mm) && o->cycles >= 1 &&
               between(o->pause_s, 0.0, 86400.0);
    case RELEASE:
        return speed;
    case ADJUST:
        return fits_change(c, o);
    default:
        return true;
    }
}

static bool is_possible(const struct controller *c, const struct order *o)
{
    if (c->drive != DRIVE_ENABLED)
        return false;
    switch (o->code) {
    case HOLD:
    case RELEASE:
        return true; /* they may end any motion */
    case ADJUST:
        return c->moving && motion_adjustable(&c->motion);
    case HARMONIC:
        return !c->moving && fabs(c->motion.command_mm - o->mean_mm) <= AT_MEAN_MM;
    case STATIC:
        return !c->moving && fabs(c->motion.command_mm) <= AT_ZERO_MM;
    default:
        return !c->moving;
    }
}

static enum reject judge(const struct controller *c, const struct order *o)
{
    if (o->code < HOLD || o->code > ADJUST)
        return UNKNOWN_COMMAND;
    if (!is_possible(c, o))
        return WRONG_STATE;
    return fits(c, o) ? ACCEPTED : OUT_OF_RANGE;
}

static struct order order_in(const uint16_t *image)
{
    return (struct order){
        .sequence = image[COMMAND_SEQUENCE],
        .code = image[COMMAND_CODE],
        .target_mm = get_float(image + TARGET),
        .speed_mm_per_s = get_float(image + SPEED),
        .mean_mm = get_float(image + MEAN),
        .amplitude_mm = get_float(image + AMPLITUDE),
        .frequency_Hz = get_float(image + FREQUENCY),
        .cycles = get_u32(image + CYCLES),
        .turning_force_kN = get_float(image + TURNING_FORCE),
        .turning_stroke_mm = get_float(image + TURNING_STROKE),
        .pause_s = get_float(image + STATIC_PAUSE),
    };
}

static void arm(struct controller *c)
{
    struct order order = order_in(c->image);
    if (order.sequence == 0 || (c->executed && order.sequence == c->armed.sequence))
        return; /* no command, or one that was done: a repeated request */
    c->armed = order;
    c->executed = false;
    c->echo = order.sequence;
    c->reject = (uint16_t)judge(c, &order);
    c->armed_good = c->reject == ACCEPTED;
}

static void execute(struct controller *c, uint16_t sequence)
{
    if (sequence == 0 || (c->executed && sequence == c->armed.sequence))
        return;
    c->echo = sequence;
    c->reject = NOT_ARMED;
    if (sequence != c->armed.sequence || !c->armed_good)
        return;
    c->reject = (uint16_t)judge(c, &c->armed); /* once more: the state may be another since */
    if (c->reject != ACCEPTED)
        return;
    c->executed = true;
    if (c->armed.code == ADJUST)
        motion_adjust(&c->motion, &c->armed); /* a change, no motion: number and count stay the sine's */
    else
        begin(c, &c->armed);
}

/* ---- on and off, CiA 402 */

static void switch_drive(struct controller *c, uint16_t word, bool reset)
{
    enum { SWITCH_ON = 1, VOLTAGE = 2, QUICK_STOP_OFF = 4, OPERATE = 8 };
    bool may = word & VOLTAGE && word & QUICK_STOP_OFF;
    switch (c->drive) {
    case DRIVE_FAULT:
        if (reset) {
            c->fault = NO_FAULT;
            c->drive = DRIVE_OFF;
        }
        break;
    case DRIVE_REACTS:
        if (!may)
            c->drive = DRIVE_FAULT; /* off is off, on the way to zero force, too */
        break;
    case DRIVE_OFF:
        if (may && !(word & SWITCH_ON))
            c->drive = DRIVE_READY;
        break;
    default:
        c->drive = !may                 ? DRIVE_OFF
                   : !(word & SWITCH_ON) ? DRIVE_READY
                   : !(word & OPERATE)   ? DRIVE_SWITCHED_ON
                                         : DRIVE_ENABLED;
    }
    switch_valve(c, is_on(c));
}

static uint16_t status_word(const struct controller *c)
{
    enum { HAS_VOLTAGE = 0x10, REMOTE = 0x200, TARGET_REACHED = 0x400 };
    bool reached = c->drive == DRIVE_ENABLED && !c->moving;
    return (uint16_t)(c->drive | HAS_VOLTAGE | REMOTE | (reached ? TARGET_REACHED : 0));
}

static uint16_t state(const struct controller *c)
{
    enum { OFF, READY, HOLDING, RAMPING, WAVEFORM, RELEASING, FAULT };
    static const uint16_t by_code[] = {HOLDING, HOLDING, RAMPING, WAVEFORM, WAVEFORM, RELEASING};
    switch (c->drive) {
    case DRIVE_OFF:
        return OFF;
    case DRIVE_FAULT:
        return FAULT;
    case DRIVE_REACTS:
        return RELEASING;
    case DRIVE_ENABLED:
        return c->moving ? by_code[c->motion.order.code] : HOLDING;
    default:
        return READY;
    }
}

/* ---- one cycle */

static void watch(struct controller *c)
{
    uint16_t time_ms = c->image[WATCHDOG_TIME];
    if (c->image[WRITER] && in_s(c->now_us - c->writer_us) > WRITER_FORGOTTEN_S)
        c->image[WRITER] = 0;
    if (c->drive != DRIVE_ENABLED)
        return;
    if (c->measured.force_kN > TRIP_RATIO * get_float(c->image + FORCE_LIMIT) + TRIP_KN) {
        give_up(c, FAULT_FORCE, BY_LIMIT);
    } else if (c->measured.position_mm > get_float(c->image + STROKE_LIMIT) + TRIP_MM) {
        give_up(c, FAULT_STROKE, BY_LIMIT);
    } else if (time_ms && c->now_us - c->fed_us > 1000u * (uint64_t)time_ms) {
        c->trips++;
        give_up(c, FAULT_WATCHDOG, BY_WATCHDOG);
    }
}

static void move(struct controller *c, double dt_s)
{
    if (!c->valve) {
        c->motion.command_mm = c->measured.position_mm;
        return;
    }
    enum reason ended = c->moving ? motion_step(&c->motion, dt_s, &c->measured) : GOES_ON;
    if (ended == GOES_ON)
        return;
    motion_over(c, ended);
    if (c->drive == DRIVE_REACTS) {
        c->drive = DRIVE_FAULT;
        switch_valve(c, false);
    }
}

struct outputs controller_cycle(struct controller *c, const struct inputs *inputs, bool good)
{
    if (!good) { /* blind: no way to release, so the valve closes at once */
        if (is_on(c)) {
            motion_over(c, BY_LIMIT);
            c->fault = FAULT_ACTUATOR;
            c->drive = DRIVE_FAULT;
            switch_valve(c, false);
        }
        return (struct outputs){.valve = false, .command_mm = c->motion.command_mm};
    }
    double dt_s = c->ring.next ? in_s(inputs->time_us - c->now_us) : 1.0 / RATE_HZ;
    c->now_us = inputs->time_us;
    c->measured = (struct measured){
        .force_kN = FORCE_KN_PER_COUNT * inputs->force,
        .stroke_mm = STROKE_MM_AT_0 + 0.5 * STROKE_MM_PER_COUNT * (inputs->stroke_1 + inputs->stroke_2),
        .position_mm = POSITION_MM_PER_COUNT * inputs->position,
    };
    /* A sample's command is the one that was in force when it was taken: the last cycle's. */
    ring_put(&c->ring, inputs, c->motion.command_mm);
    watch(c);
    move(c, fmin(dt_s, 10.0 / RATE_HZ)); /* behind a long pause the piston must not be sent far at once */
    return (struct outputs){.valve = c->valve, .command_mm = c->motion.command_mm};
}

/* ---- registers */

static bool is_written(int register_at, int address, int count)
{
    return address <= register_at && register_at < address + count;
}

/* Limits beyond what the machine can, and a second writer, are refused before anything is changed. */
static bool is_refused(const struct controller *c, const uint16_t *after, int address, int count)
{
    if (is_written(FORCE_LIMIT + 1, address, count)) {
        float limit = get_float(after + FORCE_LIMIT);
        if (!(limit > 0.0f && between(limit, 0.0, RATED_FORCE_KN)))
            return true;
    }
    if (is_written(STROKE_LIMIT + 1, address, count)) {
        float limit = get_float(after + STROKE_LIMIT);
        if (!(limit > 0.0f && between(limit, 0.0, RATED_STROKE_MM)))
            return true;
    }
    uint16_t holder = c->image[WRITER], wants = after[WRITER];
    return is_written(WRITER, address, count) && holder && wants && wants != holder;
}

enum exception controller_write(struct controller *c, int address, int count, const uint16_t *values)
{
    uint16_t after[REGISTERS], before_control = c->image[CONTROL_WORD], before_feed = c->image[WATCHDOG_FEED];
    if (!may_write(address, count))
        return ILLEGAL_ADDRESS;
    memcpy(after, c->image, sizeof after);
    memcpy(after + address, values, sizeof *values * (size_t)count);
    if (is_refused(c, after, address, count))
        return ILLEGAL_VALUE;
    memcpy(c->image, after, sizeof after);
    if (c->image[WATCHDOG_FEED] != before_feed)
        c->fed_us = c->writer_us = c->now_us;
    if (is_written(WRITER, address, count) && c->image[WRITER])
        c->writer_us = c->now_us;
    if (is_written(COMMAND_SEQUENCE, address, count) && is_written(STATIC_PAUSE + 1, address, count))
        arm(c);
    if (is_written(EXECUTE, address, count))
        execute(c, c->image[EXECUTE]);
    if (is_written(CONTROL_WORD, address, count)) {
        uint16_t word = c->image[CONTROL_WORD];
        switch_drive(c, word, word & 0x80 && !(before_control & 0x80));
    }
    return GRANTED;
}

static void put_status(const struct controller *c, uint16_t *r)
{
    uint64_t unfed_ms = (c->now_us - c->fed_us) / 1000;
    uint16_t time_ms = c->image[WATCHDOG_TIME];
    r[STATUS_WORD] = status_word(c);
    r[STATE] = state(c);
    r[FAULT_CODE] = (uint16_t)c->fault;
    r[ECHO_SEQUENCE] = c->echo;
    r[REJECT_CODE] = c->reject;
    r[DONE_SEQUENCE] = c->done;
    put_u32(r + CYCLES_DONE, c->motion.cycles_done);
    r[HEARTBEAT] = (uint16_t)(c->now_us / 10000);
    r[WATCHDOG_REMAINING] = unfed_ms < time_ms ? (uint16_t)(time_ms - unfed_ms) : 0;
    r[WATCHDOG_TRIPS] = c->trips;
    r[END_REASON] = c->reason;
    put_float(r + FORCE, (float)c->measured.force_kN);
    put_float(r + STROKE, (float)c->measured.stroke_mm);
    put_float(r + POSITION, (float)c->measured.position_mm);
    put_float(r + COMMAND, (float)c->motion.command_mm);
    put_u32(r + TICK, (uint32_t)c->now_us);
    r[REQUEST_ECHO] = c->image[REQUEST_NUMBER];
    put_u32(r + STATUS_CHECK, crc32_of(r + STATUS_WORD, STATUS_CHECK - STATUS_WORD, 0));
}

enum exception controller_read(struct controller *c, int address, int count, uint16_t *values)
{
    uint16_t shown[REGISTERS];
    if (!may_read(address, count))
        return ILLEGAL_ADDRESS;
    memcpy(shown, c->image, sizeof shown);
    if (address < STATUS_END)
        put_status(c, shown);
    if (address >= WINDOW) /* samples are told by their number, so they may be asked for twice */
        ring_window(&c->ring, get_u32(c->image + RING_ACKNOWLEDGE), status_word(c), shown + WINDOW);
    memcpy(values, shown + address, sizeof *values * (size_t)count);
    return GRANTED;
}
