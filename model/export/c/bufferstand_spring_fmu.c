/* bufferstand_spring_fmu.c: the spring as FMI 2.0 for Model Exchange and Co-Simulation.
 *
 * Copyright (c) 2026, the bufferstand maintainers. SPDX-License-Identifier: BSD-3-Clause
 *
 * One library serves every spring: curves and start values come from resources/spring.bin. Nothing is global,
 * so that any number of instances may live in one process and in several threads.
 *
 * Co-Simulation: a step goes to the stroke that stroke and stroke rate give for its end, by the exact step.
 * Model Exchange: the inner stroke is the continuous state. The band position needs none: it is exact for the
 * stroke since the last completed step, whatever the solver's tolerance. Temperature, heat and work follow in
 * fmi2CompletedIntegratorStep by the same exact step, in pieces of SUBSTEP_MM at most.
 */
#include <stdarg.h>

#ifdef BUFFERSTAND_FMI2_MINIMAL
#include "fmi2_minimal.h"
#else
#include "fmi2Functions.h"
#endif

#include "bufferstand_spring_resource.h"

#if defined(__linux__) && defined(__x86_64__) && defined(__GLIBC__) && defined(__PIC__)
/* Run on systems older than the one that built it: the newer symbol differs in errno only. */
__asm__(".symver exp,exp@GLIBC_2.2.5");
#endif

/* Value references of the real variables; parameters in the order of bs_resource.parameter. */
enum {
    V_STROKE, V_RATE, V_FORCE, V_TEMPERATURE, V_SENSOR, V_HEAT, V_WORK, V_BAND, V_INNER, V_D_INNER,
    V_PARAMETER, V_RANGE = V_PARAMETER + BS_PARAMETERS, V_END = V_RANGE + BS_RANGE
};
/* Where the spring was identified: bs_resource.range. */
enum { R_STROKE_MIN, R_STROKE_MAX, R_SPEED_MIN, R_SPEED_MAX, R_FREQUENCY_MIN, R_FREQUENCY_MAX, R_T_MIN, R_T_MAX,
       R_FULL_STROKE, R_FORCE_MIN, R_FORCE_MAX };
enum { P_INITIAL_T, P_AMBIENT, P_INITIAL_BAND, P_C_TS, P_C_ETA, P_FLOOR, P_CAPACITY, P_LOSS, P_LAG, P_GAIN,
       P_BETA, P_TAU, P_SPECTRUM, P_STOP };
enum { B_INVERTED, B_ISOTHERMAL, B_PAPER };

/* What a call may be made in. */
enum { INSTANTIATED = 1, INITIALIZING = 2, EVENT = 4, CONTINUOUS = 8, STEPPING = 16, ENDED = 32 };
#define RUNNING (EVENT | CONTINUOUS | STEPPING)
#define ALIVE (INSTANTIATED | INITIALIZING | RUNNING)

#define STATES 1
#define INDICATORS 3
#define SUBSTEP_MM 0.05
#define MOST_SUBSTEPS 4000.0

/* All that changes: copied as it is by get/setFMUstate, so no pointer in it. */
typedef struct {
    double time, last_time;
    double stroke, rate; /* as set, in the units and sign of the variables */
    double parameter[BS_PARAMETERS];
    double inner_mm; /* continuous state of Model Exchange */
    bs_spring spring;
    int flag[BS_FLAGS];
    int mode;
    int stale;  /* the spring is to be set up anew from the start values */
    int warned; /* bits of what was told about leaving the range, each once */
} memory;

typedef struct {
    memory now;
    bs_law law;
    bs_resource resource;
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    fmi2Type type;
    char *name;
} instance;

typedef struct {
    uint32_t magic, crc;
    memory content;
} snapshot;
#define SNAPSHOT_MAGIC 0x31535342u

static const struct {
    const char *name;
    double least;
    int above; /* least itself is refused */
    double most;
} RANGE[BS_PARAMETERS] = {
    {"initial_temperature_C", -273.15, 0, BS_MOST}, {"ambient_C", -273.15, 0, BS_MOST},
    {"initial_band", 0.0, 0, 1.0}, {"sensitivity_per_K", 0.0, 0, BS_MOST},
    {"loss_sensitivity_per_K", 0.0, 0, BS_MOST}, {"floor", 0.0, 1, 1.0},
    {"capacity_J_per_K", 0.0, 1, BS_MOST}, {"loss_W_per_K", 0.0, 0, BS_MOST},
    {"sensor_lag_s", 0.0, 0, BS_MOST}, {"sensor_gain", 0.0, 0, BS_MOST},
    {"beta", 0.0, 0, BS_MOST}, {"tau_s", 0.0, 1, BS_MOST},
    {"spectrum_per_decade", 0.0, 0, BS_MOST}, {"stop_stiffness", 0.0, 1, BS_MOST},
};

static void say(fmi2CallbackLogger logger, fmi2ComponentEnvironment environment, const char *name,
                fmi2Status status, const char *form, ...)
{
    char text[512];
    va_list arguments;
    if (!logger)
        return;
    va_start(arguments, form);
    vsnprintf(text, sizeof text, form, arguments);
    va_end(arguments);
    logger(environment, name, status,
           status == fmi2Warning ? "logStatusWarning" : status == fmi2Discard ? "logStatusDiscard" : "logStatusError",
           "%s", text);
}

#define SAY(status, ...) (say(me->logger, me->environment, me->name, status, __VA_ARGS__), status)

/* Begin a function: refuse a missing instance, and a call that the state of the instance does not permit. */
#define ENTER(function, modes)                                                                               \
    instance *me = (instance *)c;                                                                            \
    if (!me)                                                                                                 \
        return fmi2Error;                                                                                    \
    if (!(me->now.mode & (modes)))                                                                           \
        return SAY(fmi2Error, "%s is not allowed now: wrong order of calls", function)

static int is_number(double value)
{
    return fabs(value) <= BS_MOST; /* false for NaN */
}

static double sign_of(const instance *me)
{
    return me->now.flag[B_INVERTED] ? -1.0 : 1.0;
}

static double stroke_mm(const instance *me, double stroke)
{
    return sign_of(me) * (stroke * me->resource.mm_per_stroke);
}

static void defaults(instance *me)
{
    size_t k;
    memset(&me->now, 0, sizeof me->now);
    me->now.mode = INSTANTIATED;
    me->now.stale = 1;
    for (k = 0; k < BS_PARAMETERS; ++k)
        me->now.parameter[k] = me->resource.parameter[k];
    for (k = 0; k < BS_FLAGS; ++k)
        me->now.flag[k] = me->resource.flag[k] != 0.0;
}

static void use_parameters(instance *me)
{
    const double *p = me->now.parameter;
    bs_law *law = &me->law;
    law->reference_C = me->resource.reference_C;
    law->sensitivity_per_K = p[P_C_TS];
    law->loss_sensitivity_per_K = p[P_C_ETA];
    law->floor = p[P_FLOOR];
    law->capacity_J_per_K = p[P_CAPACITY];
    law->loss_W_per_K = p[P_LOSS];
    law->sensor_lag_s = p[P_LAG];
    law->sensor_gain = p[P_GAIN];
    law->beta = p[P_BETA];
    law->tau_s = p[P_TAU];
    law->spectrum_per_decade = p[P_SPECTRUM];
    law->stop_kN_per_mm = p[P_STOP] / (me->resource.force_per_kN * me->resource.mm_per_stroke);
    law->paper_heat = me->now.flag[B_PAPER];
    law->isothermal = me->now.flag[B_ISOTHERMAL];
    bs_prepare(law);
}

/* Set the spring up from the start values, if they have changed. */
static fmi2Status set_up(instance *me)
{
    memory *now = &me->now;
    size_t k;
    if (!now->stale)
        return fmi2OK;
    for (k = 0; k < BS_PARAMETERS; ++k) {
        const double value = now->parameter[k];
        if (!is_number(value) || value < RANGE[k].least || value > RANGE[k].most
            || (RANGE[k].above && value == RANGE[k].least))
            return SAY(fmi2Error, "parameter %s must be %s %g and at most %g, got %g", RANGE[k].name,
                       RANGE[k].above ? "above" : "at least", RANGE[k].least, RANGE[k].most, value);
    }
    if (!is_number(now->stroke))
        return SAY(fmi2Discard, "the stroke is no number");
    use_parameters(me);
    bs_start(&me->resource.table, &me->law, &now->spring, stroke_mm(me, now->stroke),
             now->parameter[P_INITIAL_BAND], now->parameter[P_INITIAL_T]);
    now->spring.ambient_C = now->parameter[P_AMBIENT];
    now->inner_mm = now->spring.x_;
    now->last_time = now->time;
    now->stale = 0;
    return fmi2OK;
}

/* Refuse inputs that are no numbers: a solver may then try another step. */
static fmi2Status check_inputs(const instance *me)
{
    if (!is_number(me->now.stroke) || !is_number(me->now.rate))
        return SAY(fmi2Discard, "%s is no number", is_number(me->now.stroke) ? "the stroke rate" : "the stroke");
    return fmi2OK;
}

enum { TOLD_TEMPERATURE = 1, TOLD_STROKE = 2, TOLD_SPEED = 4, TOLD_STOP = 8 };

/* True the first time that something is left. */
static int leaves(instance *me, int what, int left)
{
    if (!left || (me->now.warned & what))
        return 0;
    me->now.warned |= what;
    return 1;
}

/* Tell once of each what leaves the range in which the spring was identified. Of stroke and speed the upper ends
 * only: every stroke begins at contact and at rest. */
static void watch(instance *me, double speed_mm_per_s)
{
    const double *range = me->resource.range, unit = me->resource.mm_per_stroke;
    const double T = me->now.spring.temperature_C, x = me->now.spring.stroke_mm, end = me->resource.table.end_mm;
    const double known = range[R_STROKE_MAX] * unit, fastest = range[R_SPEED_MAX] * unit;
    if (leaves(me, TOLD_TEMPERATURE, T < range[R_T_MIN] || T > range[R_T_MAX]))
        (void)SAY(fmi2Warning, "the temperature of %.1f degC leaves the %g ... %g degC for which the spring was identified",
                  T, range[R_T_MIN], range[R_T_MAX]);
    if (leaves(me, TOLD_STROKE, x > known && known < end))
        (void)SAY(fmi2Warning, "the stroke of %.1f mm leaves the %.1f mm up to which the spring was identified: "
                  "its curves are continued there, not measured", x, known);
    if (leaves(me, TOLD_SPEED, speed_mm_per_s > fastest))
        (void)SAY(fmi2Warning, "the speed of %.3g mm/s leaves the %g mm/s up to which the spring was identified",
                  speed_mm_per_s, fastest);
    if (leaves(me, TOLD_STOP, x > end && known <= end))
        (void)SAY(fmi2Warning, "the stroke of %.1f mm goes beyond the end of the curves at %.4g mm into the stop of "
                  "%g kN/mm", x, end, me->law.stop_kN_per_mm);
}

/* Speed of a pressed spring between two strokes; 0 where no time passes. */
static double speed_between(double from_mm, double to_mm, double dt)
{
    return dt > 0.0 ? fabs((to_mm > 0.0 ? to_mm : 0.0) - (from_mm > 0.0 ? from_mm : 0.0)) / dt : 0.0;
}

static double own_lag_mm(const instance *me, double x_mm)
{
    return bs_clip_(x_mm, me->resource.table.end_mm) - me->now.inner_mm;
}

/* Force between two completed steps. The own branch is a state of the solver; the fast ones of the spectrum would
 * only make the equations stiff: like the band position they are exact for the stroke since the last step. */
static double force_between(const instance *me, double x_mm)
{
    const memory *now = &me->now;
    const bs_spring *spring = &now->spring;
    const double x = bs_clip_(x_mm, me->resource.table.end_mm);
    const double dt = now->time > now->last_time ? now->time - now->last_time : 0.0;
    double lag[BS_BRANCHES], kept, added;
    size_t k;
    for (k = 0; k < me->law.branches; ++k) {
        bs_relaxation_(me->law.relaxation_s[k], dt, &kept, &added);
        lag[k] = spring->lag_mm[k] * kept + (x - spring->x_) * added;
    }
    if (me->law.beta > 0.0)
        lag[0] = own_lag_mm(me, x_mm);
    return bs_force(&me->resource.table, &me->law, x_mm, bs_band_at(&me->resource.table, spring, x_mm), lag,
                    spring->temperature_C);
}

/* Let everything follow to the present time and stroke. `jump`: the stroke has jumped, the inner stroke has not. */
static void commit(instance *me, int jump)
{
    memory *now = &me->now;
    const double from = now->spring.stroke_mm, to = stroke_mm(me, now->stroke);
    const double pieces_wanted = ceil(fabs(bs_clip_(to, me->resource.table.end_mm) - now->spring.x_) / SUBSTEP_MM);
    const double pieces = pieces_wanted < 1.0 ? 1.0 : pieces_wanted < MOST_SUBSTEPS ? pieces_wanted : MOST_SUBSTEPS;
    const double whole = now->time > now->last_time ? now->time - now->last_time : 0.0, dt = whole / pieces;
    const double lag = own_lag_mm(me, to);
    double k;
    for (k = 1.0; k < pieces; k += 1.0)
        bs_step(&me->resource.table, &me->law, &now->spring, from + (to - from) * (k / pieces), dt);
    bs_move_(&me->resource.table, &me->law, &now->spring, to, dt,
             !jump && me->law.beta > 0.0 ? &lag : NULL);
    now->last_time = now->time;
    watch(me, jump ? 0.0 : speed_between(from, to, whole));
}

static double value_of(const instance *me, fmi2ValueReference reference)
{
    const memory *now = &me->now;
    const bs_spring *spring = &now->spring;
    const int stepped = me->type == fmi2CoSimulation;
    const double x = stepped ? spring->stroke_mm : stroke_mm(me, now->stroke);
    const double inner = !stepped ? now->inner_mm : me->law.beta > 0.0 ? spring->x_ - spring->lag_mm[0] : spring->x_;
    switch (reference) {
    case V_STROKE: return now->stroke;
    case V_RATE: return now->rate;
    case V_FORCE:
        return sign_of(me) * (stepped ? spring->force_kN : force_between(me, x)) * me->resource.force_per_kN;
    case V_TEMPERATURE: return spring->temperature_C;
    case V_SENSOR: return spring->sensor_temperature_C;
    case V_HEAT: return spring->heat_J;
    case V_WORK: return spring->work_J;
    case V_BAND: return stepped ? spring->band : bs_band_at(&me->resource.table, spring, x);
    case V_INNER: return inner / me->resource.mm_per_stroke;
    case V_D_INNER:
        return (bs_clip_(x, me->resource.table.end_mm) - inner) / me->law.tau_s / me->resource.mm_per_stroke;
    default:
        return reference < V_RANGE ? now->parameter[reference - V_PARAMETER] : me->resource.range[reference - V_RANGE];
    }
}

/* ---- identity, life ---- */

FMI2_Export const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

FMI2_Export const char *fmi2GetVersion(void)
{
    return "2.0";
}

FMI2_Export fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                                           const fmi2String categories[])
{
    ENTER("fmi2SetDebugLogging", ALIVE | ENDED);
    (void)loggingOn, (void)nCategories, (void)categories; /* there are no messages but of status */
    return fmi2OK;
}

FMI2_Export fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                                          fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                                          fmi2Boolean visible, fmi2Boolean loggingOn)
{
    fmi2CallbackLogger logger = functions ? functions->logger : NULL;
    fmi2ComponentEnvironment environment = functions ? functions->componentEnvironment : NULL;
    const char *name = instanceName ? instanceName : "", *wrong;
    char *path = NULL;
    FILE *file = NULL;
    instance *me;
    (void)visible, (void)loggingOn;
    if (!*name || !fmuGUID || !fmuResourceLocation || !*fmuResourceLocation) {
        say(logger, environment, name, fmi2Error, "instance name, GUID and resource location must be given");
        return NULL;
    }
    me = calloc(1, sizeof *me);
    if (me)
        me->name = malloc(strlen(name) + 1);
    path = bs_path_of(fmuResourceLocation, "spring.bin",
#ifdef _WIN32
                      1
#else
                      0
#endif
    );
    if (!me || !me->name || !path)
        wrong = "does not fit into memory";
    else if (!(file = bs_open_(path)))
        wrong = "cannot be opened";
    else {
        wrong = bs_read_(&me->resource, file);
        if (!wrong && strcmp(me->resource.guid, fmuGUID) != 0)
            wrong = "belongs to another FMU (its GUID differs)";
    }
    if (file)
        fclose(file);
    if (wrong) {
        say(logger, environment, name, fmi2Error, "the table of the spring %s: %s", wrong, path ? path : "");
        free(path);
        fmi2FreeInstance(me);
        return NULL;
    }
    free(path);
    strcpy(me->name, name);
    me->logger = logger;
    me->environment = environment;
    me->type = fmuType;
    defaults(me);
    return me;
}

FMI2_Export void fmi2FreeInstance(fmi2Component c)
{
    instance *me = (instance *)c;
    if (!me)
        return;
    bs_release(&me->resource);
    free(me->name);
    free(me);
}

FMI2_Export fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                                           fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    ENTER("fmi2SetupExperiment", INSTANTIATED);
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    if (!is_number(startTime))
        return SAY(fmi2Error, "the start time is no number");
    me->now.time = startTime;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ENTER("fmi2EnterInitializationMode", INSTANTIATED);
    me->now.mode = INITIALIZING;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    fmi2Status status;
    ENTER("fmi2ExitInitializationMode", INITIALIZING);
    me->now.stale = 1;
    status = set_up(me);
    if (status == fmi2OK) {
        me->now.mode = me->type == fmi2ModelExchange ? EVENT : STEPPING;
        watch(me, 0.0);
    }
    return status;
}

FMI2_Export fmi2Status fmi2Terminate(fmi2Component c)
{
    ENTER("fmi2Terminate", RUNNING);
    me->now.mode = ENDED;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2Reset(fmi2Component c)
{
    ENTER("fmi2Reset", ALIVE | ENDED);
    defaults(me);
    return fmi2OK;
}

/* ---- variables ---- */

FMI2_Export fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    fmi2Status status;
    size_t k;
    ENTER("fmi2GetReal", ALIVE | ENDED);
    if (me->now.mode & (INSTANTIATED | INITIALIZING)) {
        for (k = 0; k < nvr; ++k)
            if (vr[k] >= V_FORCE && vr[k] < V_PARAMETER && (status = set_up(me)) != fmi2OK)
                return status;
    } else if (me->type == fmi2ModelExchange && (status = check_inputs(me)) != fmi2OK)
        return status;
    for (k = 0; k < nvr; ++k) {
        if (vr[k] >= V_END)
            return SAY(fmi2Error, "there is no real variable with value reference %u", vr[k]);
        value[k] = value_of(me, vr[k]);
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    size_t k;
    ENTER("fmi2GetBoolean", ALIVE | ENDED);
    for (k = 0; k < nvr; ++k) {
        if (vr[k] >= BS_FLAGS)
            return SAY(fmi2Error, "there is no Boolean variable with value reference %u", vr[k]);
        value[k] = me->now.flag[vr[k]] ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

static fmi2Status set_real(instance *me, fmi2ValueReference reference, double value)
{
    if (reference == V_STROKE || reference == V_RATE) {
        /* Kept even if it is no number, so that nothing goes on in silence with an older one. */
        *(reference == V_STROKE ? &me->now.stroke : &me->now.rate) = value;
        me->now.stale |= (me->now.mode & (INSTANTIATED | INITIALIZING)) != 0;
        return check_inputs(me);
    }
    if (reference < V_PARAMETER || reference >= V_RANGE)
        return SAY(fmi2Error, "the real variable with value reference %u cannot be set", reference);
    if (!is_number(value))
        return SAY(fmi2Error, "parameter %s is no number", RANGE[reference - V_PARAMETER].name);
    if (me->now.mode & RUNNING) {
        if (reference != V_PARAMETER + P_AMBIENT)
            return SAY(fmi2Error, "parameter %s is fixed after initialization", RANGE[reference - V_PARAMETER].name);
        me->now.spring.ambient_C = value;
    } else
        me->now.stale = 1;
    me->now.parameter[reference - V_PARAMETER] = value;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    fmi2Status worst = fmi2OK;
    size_t k;
    ENTER("fmi2SetReal", ALIVE);
    for (k = 0; k < nvr; ++k) {
        const fmi2Status status = set_real(me, vr[k], value[k]);
        worst = status > worst ? status : worst;
    }
    return worst;
}

FMI2_Export fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                      const fmi2Boolean value[])
{
    size_t k;
    ENTER("fmi2SetBoolean", INSTANTIATED | INITIALIZING);
    for (k = 0; k < nvr; ++k) {
        if (vr[k] >= BS_FLAGS)
            return SAY(fmi2Error, "there is no Boolean variable with value reference %u", vr[k]);
        me->now.flag[vr[k]] = value[k] != fmi2False;
        me->now.stale = 1;
    }
    return fmi2OK;
}

#define NONE_OF_THE_KIND(kind)                                                                               \
    (void)vr, (void)value;                                                                                   \
    return nvr ? SAY(fmi2Error, "there are no variables of type %s", kind) : fmi2OK

FMI2_Export fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    ENTER("fmi2GetInteger", ALIVE | ENDED);
    NONE_OF_THE_KIND("Integer");
}

FMI2_Export fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    ENTER("fmi2GetString", ALIVE | ENDED);
    NONE_OF_THE_KIND("String");
}

FMI2_Export fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                      const fmi2Integer value[])
{
    ENTER("fmi2SetInteger", ALIVE);
    NONE_OF_THE_KIND("Integer");
}

FMI2_Export fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                     const fmi2String value[])
{
    ENTER("fmi2SetString", ALIVE);
    NONE_OF_THE_KIND("String");
}

/* ---- state of the FMU ---- */

FMI2_Export fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    snapshot *kept;
    ENTER("fmi2GetFMUstate", ALIVE | ENDED);
    if (!FMUstate)
        return SAY(fmi2Error, "fmi2GetFMUstate: no place for the state");
    kept = *FMUstate ? (snapshot *)*FMUstate : calloc(1, sizeof *kept);
    if (!kept)
        return SAY(fmi2Error, "fmi2GetFMUstate: no memory");
    kept->magic = SNAPSHOT_MAGIC;
    kept->crc = me->resource.crc;
    memcpy(&kept->content, &me->now, sizeof kept->content);
    *FMUstate = kept;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    const snapshot *kept = (const snapshot *)FMUstate;
    ENTER("fmi2SetFMUstate", ALIVE | ENDED);
    if (!kept || kept->magic != SNAPSHOT_MAGIC || kept->crc != me->resource.crc)
        return SAY(fmi2Error, "fmi2SetFMUstate: this is no state of this FMU");
    memcpy(&me->now, &kept->content, sizeof me->now);
    use_parameters(me);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    ENTER("fmi2FreeFMUstate", ALIVE | ENDED);
    if (FMUstate) {
        free(*FMUstate);
        *FMUstate = NULL;
    }
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    ENTER("fmi2SerializedFMUstateSize", ALIVE | ENDED);
    (void)FMUstate;
    *size = sizeof(snapshot);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[],
                                             size_t size)
{
    ENTER("fmi2SerializeFMUstate", ALIVE | ENDED);
    if (!FMUstate || size < sizeof(snapshot))
        return SAY(fmi2Error, "fmi2SerializeFMUstate: no state, or too little room for it");
    memcpy(serializedState, FMUstate, sizeof(snapshot));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                               fmi2FMUstate *FMUstate)
{
    snapshot *kept;
    ENTER("fmi2DeSerializeFMUstate", ALIVE | ENDED);
    if (!FMUstate || size != sizeof *kept)
        return SAY(fmi2Error, "fmi2DeSerializeFMUstate: this is no state of this FMU");
    kept = *FMUstate ? (snapshot *)*FMUstate : calloc(1, sizeof *kept);
    if (!kept)
        return SAY(fmi2Error, "fmi2DeSerializeFMUstate: no memory");
    memcpy(kept, serializedState, sizeof *kept);
    *FMUstate = kept;
    if (kept->magic != SNAPSHOT_MAGIC || kept->crc != me->resource.crc)
        return SAY(fmi2Error, "fmi2DeSerializeFMUstate: this is no state of this FMU");
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                                    size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                                    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    ENTER("fmi2GetDirectionalDerivative", ALIVE | ENDED);
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown, (void)dvKnown, (void)dvUnknown;
    return SAY(fmi2Error, "directional derivatives are not offered");
}

/* ---- Model Exchange ---- */

FMI2_Export fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    ENTER("fmi2EnterEventMode", EVENT | CONTINUOUS);
    me->now.mode = EVENT;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    fmi2Status status;
    ENTER("fmi2NewDiscreteStates", EVENT);
    if ((status = check_inputs(me)) != fmi2OK)
        return status;
    memset(eventInfo, 0, sizeof *eventInfo);
    if (me->now.time > me->now.last_time)
        commit(me, 0);
    if (stroke_mm(me, me->now.stroke) != me->now.spring.stroke_mm)
        commit(me, 1);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    ENTER("fmi2EnterContinuousTimeMode", EVENT);
    me->now.mode = CONTINUOUS;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                                   fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    fmi2Status status;
    ENTER("fmi2CompletedIntegratorStep", CONTINUOUS);
    (void)noSetFMUStatePriorToCurrentPoint;
    *enterEventMode = *terminateSimulation = fmi2False;
    if ((status = check_inputs(me)) != fmi2OK)
        return status;
    commit(me, 0);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    ENTER("fmi2SetTime", EVENT | CONTINUOUS);
    if (!is_number(time))
        return SAY(fmi2Error, "the time is no number");
    me->now.time = time;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    ENTER("fmi2SetContinuousStates", EVENT | CONTINUOUS);
    if (nx != STATES)
        return SAY(fmi2Error, "there are %d continuous states", STATES);
    if (!is_number(x[0]))
        return SAY(fmi2Discard, "the state is no number");
    me->now.inner_mm = x[0] * me->resource.mm_per_stroke;
    return fmi2OK;
}

static fmi2Status get_state(fmi2Component c, const char *function, double values[], size_t nx,
                            fmi2ValueReference reference)
{
    fmi2Status status;
    ENTER(function, INITIALIZING | EVENT | CONTINUOUS | ENDED);
    if (nx != STATES)
        return SAY(fmi2Error, "there are %d continuous states", STATES);
    if ((status = me->now.mode == INITIALIZING ? set_up(me) : check_inputs(me)) != fmi2OK)
        return status;
    values[0] = value_of(me, reference);
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    return get_state(c, "fmi2GetDerivatives", derivatives, nx, V_D_INNER);
}

FMI2_Export fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    return get_state(c, "fmi2GetContinuousStates", x, nx, V_INNER);
}

FMI2_Export fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    fmi2Status status;
    ENTER("fmi2GetEventIndicators", INITIALIZING | EVENT | CONTINUOUS | ENDED);
    if (ni != INDICATORS)
        return SAY(fmi2Error, "there are %d event indicators", INDICATORS);
    if ((status = check_inputs(me)) != fmi2OK)
        return status;
    eventIndicators[0] = me->now.rate; /* loading or unloading */
    eventIndicators[1] = stroke_mm(me, me->now.stroke) / me->resource.mm_per_stroke; /* contact */
    eventIndicators[2] = eventIndicators[1] - me->resource.table.end_mm / me->resource.mm_per_stroke; /* stop */
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    ENTER("fmi2GetNominalsOfContinuousStates", ALIVE | ENDED);
    if (nx != STATES)
        return SAY(fmi2Error, "there are %d continuous states", STATES);
    x_nominal[0] = 10.0 / me->resource.mm_per_stroke;
    return fmi2OK;
}

/* ---- Co-Simulation ---- */

FMI2_Export fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                                  fmi2Real communicationStepSize, fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    const double h = communicationStepSize;
    fmi2Status status;
    double from, end;
    ENTER("fmi2DoStep", STEPPING);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!is_number(currentCommunicationPoint) || !is_number(h) || h < 0.0)
        return SAY(fmi2Error, "the step size must be 0 or more, and a number");
    if ((status = check_inputs(me)) != fmi2OK)
        return status;
    end = stroke_mm(me, me->now.stroke + me->now.rate * h);
    if (!is_number(end))
        return SAY(fmi2Discard, "the stroke at the end of the step is no number");
    from = me->now.spring.stroke_mm;
    bs_step(&me->resource.table, &me->law, &me->now.spring, end, h);
    me->now.time = currentCommunicationPoint + h;
    watch(me, speed_between(from, end, h));
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                                   const fmi2Integer order[], const fmi2Real value[])
{
    ENTER("fmi2SetRealInputDerivatives", ALIVE);
    (void)vr, (void)nvr, (void)order, (void)value;
    return SAY(fmi2Error, "derivatives of inputs are not offered: connect the stroke rate");
}

FMI2_Export fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                                    const fmi2Integer order[], fmi2Real value[])
{
    ENTER("fmi2GetRealOutputDerivatives", ALIVE | ENDED);
    (void)vr, (void)nvr, (void)order, (void)value;
    return SAY(fmi2Error, "derivatives of outputs are not offered");
}

FMI2_Export fmi2Status fmi2CancelStep(fmi2Component c)
{
    ENTER("fmi2CancelStep", STEPPING);
    return SAY(fmi2Error, "a step is never pending");
}

FMI2_Export fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    ENTER("fmi2GetRealStatus", STEPPING | ENDED);
    if (s != fmi2LastSuccessfulTime)
        return SAY(fmi2Discard, "this status is not offered");
    *value = me->now.time;
    return fmi2OK;
}

#define NO_STATUS(function)                                                                                  \
    ENTER(function, STEPPING | ENDED);                                                                       \
    (void)s, (void)value;                                                                                    \
    return SAY(fmi2Discard, "a step is never pending")

FMI2_Export fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    NO_STATUS("fmi2GetStatus");
}

FMI2_Export fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    NO_STATUS("fmi2GetIntegerStatus");
}

FMI2_Export fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    ENTER("fmi2GetBooleanStatus", STEPPING | ENDED);
    if (s != fmi2Terminated)
        return SAY(fmi2Discard, "this status is not offered");
    *value = fmi2False;
    return fmi2OK;
}

FMI2_Export fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    NO_STATUS("fmi2GetStringStatus");
}
