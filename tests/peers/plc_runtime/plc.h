/* What a compiled ST program is to the runtime: globals of its CONFIGURATION, and one scan. */
#ifndef PLC_H
#define PLC_H

#include "hal.h"

#include <stdint.h>

void plc_start(void);
struct outputs plc_scan(const struct inputs *inputs, int good);
uint16_t *plc_registers(void);

#endif
