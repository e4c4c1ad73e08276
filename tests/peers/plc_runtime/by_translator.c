/* The program as the translator of tests/peers/structured_text has made it: its globals are called plc_NAME. */
#include "program.c"

#include "plc.h"

void plc_start(void)
{
    plc_init();
    plc_IO_SIMULATED = hal_is_simulated();
}

struct outputs plc_scan(const struct inputs *inputs, int good)
{
    plc_IO_CLOCK_US = (uint32_t)inputs->time_us;
    plc_IO_GOOD = (uint8_t)good;
    plc_IO_FORCE = inputs->force;
    plc_IO_STROKE_1 = inputs->stroke_1;
    plc_IO_STROKE_2 = inputs->stroke_2;
    plc_IO_POSITION = inputs->position;
    plc_run();
    return (struct outputs){.valve = plc_IO_VALVE, .command_mm = plc_IO_COMMAND};
}

uint16_t *plc_registers(void)
{
    return plc_REGISTERS;
}
