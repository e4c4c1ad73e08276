/* A C host that uses and misuses the FMU's source under sanitizers: master URI GUID steps; prints the forces of
 * Co-Simulation. Whatever it leaves allocated is a leak. */
#include <stdarg.h>

#define BUFFERSTAND_FMI2_MINIMAL
#include "bufferstand_spring_fmu.c"

static int told;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String form, ...)
{
    va_list arguments;
    char text[1024];
    (void)environment, (void)name, (void)status, (void)category;
    va_start(arguments, form);
    vsnprintf(text, sizeof text, form, arguments);
    va_end(arguments);
    ++told;
}

static const fmi2CallbackFunctions CALLBACKS = {logger, NULL, NULL, NULL, NULL};

static fmi2Component begin(char **argument, fmi2Type type)
{
    fmi2Component c = fmi2Instantiate("c", type, argument[2], argument[1], &CALLBACKS, fmi2False, fmi2True);
    if (!c || fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) || fmi2EnterInitializationMode(c)
        || fmi2ExitInitializationMode(c))
        exit(3);
    return c;
}

static void co_simulation(char **argument, int steps)
{
    const fmi2ValueReference input[2] = {0, 1}, force = 2, band = 7;
    fmi2Component c = begin(argument, fmi2CoSimulation), other = begin(argument, fmi2CoSimulation);
    fmi2FMUstate kept = NULL, carried = NULL;
    fmi2Byte *bytes;
    size_t size;
    double value, odd[] = {NAN, HUGE_VAL, -1e300, 1e11};
    int k;
    for (k = 0; k < steps; ++k) {
        const double at[2] = {50.0 - 60.0 * cos(0.01 * k), 0.0}; /* lost contact to stop */
        fmi2SetReal(c, input, 2, at);
        if (fmi2DoStep(c, 0.001 * k, 0.001, fmi2True) != fmi2OK)
            exit(4);
        fmi2GetReal(c, &force, 1, &value);
        printf("%.17g\n", value);
        if (k == steps / 2)
            fmi2GetFMUstate(c, &kept);
    }
    for (k = 0; k < 4; ++k) {
        fmi2SetReal(other, input, 1, &odd[k]);
        fmi2DoStep(other, 0.0, 0.001, fmi2True);
        fmi2GetReal(other, &band, 1, &value);
    }
    fmi2SerializedFMUstateSize(c, kept, &size);
    bytes = malloc(size);
    fmi2SerializeFMUstate(c, kept, bytes, size);
    if (fmi2DeSerializeFMUstate(other, bytes, size, &carried) || fmi2SetFMUstate(other, carried))
        exit(5);
    bytes[0] ^= 1;
    if (fmi2DeSerializeFMUstate(other, bytes, size, &carried) == fmi2OK || fmi2SetFMUstate(other, NULL) == fmi2OK)
        exit(6);
    free(bytes);
    fmi2FreeFMUstate(c, &kept);
    fmi2FreeFMUstate(other, &carried);
    fmi2Terminate(c);
    fmi2Reset(c);
    fmi2FreeInstance(c);
    fmi2FreeInstance(other);
    fmi2FreeInstance(NULL);
}

static void model_exchange(char **argument, int steps)
{
    const fmi2ValueReference input[2] = {0, 1}, all[25] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12,
                                                           13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24};
    fmi2Component c = begin(argument, fmi2ModelExchange);
    fmi2EventInfo info;
    fmi2Boolean event, end;
    double x, slope, indicators[3], values[25];
    int k;
    for (k = 0; k < steps; ++k) {
        const double at[2] = {50.0 - 60.0 * cos(0.01 * k), 600.0 * sin(0.01 * k)};
        if (k % 100 == 0) {
            fmi2EnterEventMode(c);
            fmi2SetReal(c, input, 2, at);
            fmi2NewDiscreteStates(c, &info);
            fmi2EnterContinuousTimeMode(c);
        }
        fmi2GetContinuousStates(c, &x, 1);
        fmi2GetDerivatives(c, &slope, 1);
        x += k % 7 ? 0.001 * slope : 1e9; /* a solver gone astray must not lead outside of the tables */
        fmi2SetTime(c, 0.001 * (k + 1));
        fmi2SetReal(c, input, 2, at);
        fmi2SetContinuousStates(c, &x, 1);
        fmi2GetReal(c, all, 25, values);
        fmi2GetEventIndicators(c, indicators, 3);
        if (fmi2CompletedIntegratorStep(c, fmi2True, &event, &end) != fmi2OK)
            exit(7);
        x = 0.0;
        fmi2SetContinuousStates(c, &x, 1);
    }
    fmi2FreeInstance(c);
}

int main(int count, char **argument)
{
    static const char *uris[] = {"", "file:", "file://", "file:///", "file:///%", "file:///%4", "%41", "/nowhere",
                                 "http://x/y", "file://localhost", "file:///C:/a%20b"};
    size_t k;
    if (count != 4)
        return 2;
    for (k = 0; k < sizeof uris / sizeof *uris; ++k)
        if (fmi2Instantiate("c", fmi2CoSimulation, argument[2], uris[k], &CALLBACKS, fmi2False, fmi2False))
            return 8;
    if (fmi2Instantiate("c", fmi2CoSimulation, "{}", argument[1], &CALLBACKS, fmi2False, fmi2False)
        || fmi2Instantiate(NULL, fmi2CoSimulation, NULL, NULL, NULL, fmi2False, fmi2False) || !told)
        return 9;
    co_simulation(argument, atoi(argument[3]));
    model_exchange(argument, atoi(argument[3]));
    return 0;
}
