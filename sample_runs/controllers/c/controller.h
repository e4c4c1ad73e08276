/* The controller: one cycle at a time on one side, one Modbus request at a time on the other; it knows neither wires
 * nor threads. Who calls from two threads holds a lock meanwhile (main.c).
 */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include "hal.h"
#include "motions.h"
#include "registers.h"
#include "ring.h"

#include <stdbool.h>
#include <stdint.h>

enum drive_state { /* the bits of the status word that tell the state, CiA 402 */
    DRIVE_OFF = 0x40, /* switch-on disabled */
    DRIVE_READY = 0x21,
    DRIVE_SWITCHED_ON = 0x23,
    DRIVE_ENABLED = 0x27,
    DRIVE_REACTS = 0x0F, /* to a fault: it releases, valve open */
    DRIVE_FAULT = 0x08
};
enum fault { NO_FAULT, FAULT_WATCHDOG, FAULT_FORCE, FAULT_STROKE, FAULT_ACTUATOR }; /* register fault_code */
enum reject { ACCEPTED, UNKNOWN_COMMAND, WRONG_STATE, OUT_OF_RANGE, NOT_ARMED }; /* register reject_code */

struct controller {
    uint16_t image[REGISTERS]; /* holding registers as they were written */
    struct ring ring;
    struct motion motion;
    struct measured measured;
    bool moving; /* a motion is under way */
    enum drive_state drive;
    enum fault fault;
    bool valve;
    struct order armed;
    bool armed_good; /* it was judged and may be executed */
    bool executed; /* it was executed: its number changes nothing any more */
    uint16_t echo, reject, done, reason, trips;
    uint64_t now_us, fed_us, writer_us; /* the last cycle; when the watchdog, and the writer, were last heard of */
};

/* As after power-up: off, nobody's, nothing armed. */
void controller_start(struct controller *controller, uint32_t serial);

/* One cycle: what was sampled goes in, what the valve is to do comes out. `good` is false where there is no sample. */
struct outputs controller_cycle(struct controller *controller, const struct inputs *inputs, bool good);

/* A request's registers, written before others are read; returns a Modbus exception, then nothing has changed. */
enum exception controller_write(struct controller *controller, int address, int count, const uint16_t *values);
enum exception controller_read(struct controller *controller, int address, int count, uint16_t *values);

#endif
