/* The program as matiec's iec2c has compiled it: its globals are reached by functions that it makes. */
#include "iec_types_all.h"

#include "POUS.h"

#include "plc.h"

void config_init__(void);
void config_run__(unsigned long tick);
__ARRAY_OF_WORD_400 *__GET_GLOBAL_REGISTERS(void);
UDINT *__GET_GLOBAL_IO_CLOCK_US(void);
BOOL *__GET_GLOBAL_IO_GOOD(void);
DINT *__GET_GLOBAL_IO_FORCE(void);
UINT *__GET_GLOBAL_IO_STROKE_1(void);
UINT *__GET_GLOBAL_IO_STROKE_2(void);
INT *__GET_GLOBAL_IO_POSITION(void);
BOOL *__GET_GLOBAL_IO_SIMULATED(void);
BOOL *__GET_GLOBAL_IO_VALVE(void);
LREAL *__GET_GLOBAL_IO_COMMAND(void);

TIME __CURRENT_TIME; /* matiec's timers want it; the program has none */
BOOL __DEBUG;

void plc_start(void)
{
    config_init__();
    *__GET_GLOBAL_IO_SIMULATED() = (BOOL)hal_is_simulated();
}

struct outputs plc_scan(const struct inputs *inputs, int good)
{
    static unsigned long tick;
    *__GET_GLOBAL_IO_CLOCK_US() = (UDINT)inputs->time_us;
    *__GET_GLOBAL_IO_GOOD() = (BOOL)good;
    *__GET_GLOBAL_IO_FORCE() = inputs->force;
    *__GET_GLOBAL_IO_STROKE_1() = inputs->stroke_1;
    *__GET_GLOBAL_IO_STROKE_2() = inputs->stroke_2;
    *__GET_GLOBAL_IO_POSITION() = inputs->position;
    config_run__(tick++);
    return (struct outputs){.valve = *__GET_GLOBAL_IO_VALVE(), .command_mm = *__GET_GLOBAL_IO_COMMAND()};
}

uint16_t *plc_registers(void)
{
    return __GET_GLOBAL_REGISTERS()->table;
}
