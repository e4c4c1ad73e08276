/* bufferstand_spring.h: the spring model of bufferstand as plain C99, without any tool behind it.
 *
 * Copyright (c) 2026, the bufferstand maintainers. SPDX-License-Identifier: BSD-3-Clause
 *
 * The same step as model/stepper.py, operation by operation: compiled without contraction
 * (-ffp-contract=off) and without fast-math it gives the same bits. Symbols and equations: docs/model.md.
 *
 * Units: mm, kN, s, J, W, degC; 1 kN mm = 1 J. Loading is positive. x <= 0 is lost contact.
 * Nothing here is global, allocates, or fails: a stroke or duration that is no number gives NAN and
 * leaves the spring as it was.
 *
 *     bs_spring spring;
 *     bs_prepare(&law);
 *     bs_start(&table, &law, &spring, 0.0, 0.0, 20.0);
 *     force_kN = bs_step(&table, &law, &spring, stroke_mm, 0.001);
 */
#ifndef BUFFERSTAND_SPRING_H
#define BUFFERSTAND_SPRING_H

#include <math.h>
#include <stddef.h>

/* Strokes and durations beyond this are no numbers of a spring. */
#define BS_MOST 1e12

/* Viscous branches: the own one and the flat spectrum's. */
#define BS_BRANCHES 7
#define BS_SPECTRUM_S \
    0.0028452470560622767, 0.008997461203045586, 0.028452470560622767, 0.08997461203045586, 0.28452470560622767, 0.8997461203045585

/* One cell of the grid: value at its beginning and slope of each table, in the order of use. */
typedef struct {
    double A, dA;           /* integral of a = (k_t - k_u)/h [-] */
    double B, dB;           /* integral of b = (k_t - k_l)/h [-] */
    double F_l, dF_l;       /* loading curve [kN] */
    double h, dh;           /* F_l - F_u [kN] */
    double F_m, dF_m;       /* (F_l + F_u)/2 [kN] */
    double centre, dcentre; /* elastic centre p* [-] */
    double G, dG;           /* free energy is G (p - p*)^2/2 [J] */
    double g, dg;           /* depth factor 1 - exp(-x/alpha) of eq. (5) [-] */
} bs_cell;

typedef struct {
    size_t cells; /* grid cells; `cell` has one more, for the last stroke itself */
    double step_mm, per_step, end_mm; /* per_step is 1/step_mm */
    double width_scale_max; /* largest factor on h that leaves F_u >= 0 */
    const bs_cell *cell;
} bs_table;

typedef struct {
    double reference_C;              /* T_ref of the curves */
    double sensitivity_per_K;        /* c_ts >= 0 */
    double loss_sensitivity_per_K;   /* c_eta >= 0 */
    double floor;                    /* least s, above 0 and not above 1 */
    double capacity_J_per_K;         /* C > 0 */
    double loss_W_per_K;             /* lambda >= 0 */
    double sensor_lag_s;             /* >= 0 */
    double sensor_gain;              /* >= 0 */
    double beta;                     /* viscous share >= 0 */
    double tau_s;                    /* its relaxation time > 0 */
    double spectrum_per_decade;      /* b of the flat spectrum, >= 0 */
    double stop_kN_per_mm;           /* stiffness added beyond the table > 0 */
    int paper_heat;                  /* heat by eq. (8) instead of the loop-exact rule */
    int isothermal;                  /* keep the temperature, whatever the heat */
    /* Made by bs_prepare(): where the softening ends above T_ref, and the branches that are there. */
    double spent_K;
    size_t branches;
    double share[BS_BRANCHES], relaxation_s[BS_BRANCHES];
} bs_law;

/* The spring's memory. Read what has no bar under it; set ambient_C at any time. */
typedef struct {
    double stroke_mm, force_kN;
    double band;   /* p = (F - F_u)/(F_l - F_u) */
    double lag_mm[BS_BRANCHES]; /* x - xi of each viscous branch */
    double temperature_C, sensor_temperature_C, ambient_C;
    double work_J, heat_J;
    double owed_; /* heat held back because it came out negative */
    double x_, A_, B_, g_, h_, m_, psi_; /* of the stroke before */
    double inner_[BS_BRANCHES], g_inner_[BS_BRANCHES];
    double dt_, share_, per_joule_, follow_; /* of the last duration */
    double kept_[BS_BRANCHES], added_[BS_BRANCHES];
} bs_spring;

static inline double bs_clip_(double x, double end)
{
    return x < 0.0 ? 0.0 : x < end ? x : end;
}

/* c_ts (T - T_ref), not above 1 - floor */
static inline double bs_softening_(const bs_law *law, double warmer)
{
    return warmer < law->spent_K ? law->sensitivity_per_K * warmer : 1.0 - law->floor;
}

/* e = 1 - c_eta (T - T_ref), between 0 and what leaves F_u >= 0 */
static inline double bs_width_scale_(const bs_table *table, const bs_law *law, double warmer)
{
    const double e = 1.0 - law->loss_sensitivity_per_K * warmer;
    return e < 0.0 ? 0.0 : e < table->width_scale_max ? e : table->width_scale_max;
}

/* Call once after the law's numbers are set. */
static inline void bs_prepare(bs_law *law)
{
    /* The middles of half decades from 1.6 ms to 1.6 s, as model/spring.py has them. */
    static const double times[BS_BRANCHES - 1] = {BS_SPECTRUM_S};
    size_t k;
    law->spent_K = law->sensitivity_per_K > 0.0 ? (1.0 - law->floor) / law->sensitivity_per_K : HUGE_VAL;
    law->branches = 0;
    if (law->beta > 0.0) {
        law->share[0] = law->beta;
        law->relaxation_s[0] = law->tau_s;
        law->branches = 1;
    }
    if (law->spectrum_per_decade > 0.0)
        for (k = 0; k < BS_BRANCHES - 1; ++k, ++law->branches) {
            law->share[law->branches] = 0.5 * law->spectrum_per_decade;
            law->relaxation_s[law->branches] = times[k];
        }
}

/* Factors (kept, added) of lag1 = kept lag0 + added dx for a stroke linear in time. */
static inline void bs_relaxation_(double tau_s, double dt_s, double *kept, double *added)
{
    *kept = *added = 1.0;
    if (dt_s > 1e-12 * tau_s) {
        const double gone = -expm1(-dt_s / tau_s);
        *kept = 1.0 - gone;
        *added = gone * tau_s / dt_s;
    }
}

/* Factors that depend on the duration of a step only: viscous branch, eq. (7), sensor. */
static inline void bs_duration_(const bs_law *law, bs_spring *spring, double dt)
{
    double share = 0.0, per_watt = dt / law->capacity_J_per_K;
    size_t k;
    spring->dt_ = dt;
    for (k = 0; k < law->branches; ++k)
        bs_relaxation_(law->relaxation_s[k], dt, &spring->kept_[k], &spring->added_[k]);
    if (law->loss_W_per_K != 0.0) {
        share = -expm1(-law->loss_W_per_K * dt / law->capacity_J_per_K);
        per_watt = share / law->loss_W_per_K;
    }
    spring->share_ = share;
    spring->per_joule_ = dt > 0.0 ? per_watt / dt : 1.0 / law->capacity_J_per_K;
    spring->follow_ = law->sensor_lag_s > 0.0 ? -expm1(-dt / law->sensor_lag_s) : 1.0;
}

/* Force [kN] of a known state; changes nothing. lag_mm: one for each of the law's branches. */
static inline double bs_force(const bs_table *table, const bs_law *law, double stroke_mm, double band,
                              const double lag_mm[], double temperature_C)
{
    const double x = bs_clip_(stroke_mm, table->end_mm), per_step = table->per_step;
    const size_t i = (size_t)(x * per_step);
    const bs_cell *c = &table->cell[i];
    const double f = x - (double)i * table->step_mm;
    const double warmer = temperature_C - law->reference_C;
    const double soft = bs_softening_(law, warmer);
    const double s = 1.0 - soft * (c->g + c->dg * f);
    double h = c->h + c->dh * f, force, middle;
    size_t k;
    if (law->loss_sensitivity_per_K != 0.0)
        h *= bs_width_scale_(table, law, warmer);
    force = s * (c->F_l + c->dF_l * f - (1.0 - band) * h);
    middle = s * (c->F_m + c->dF_m * f);
    for (k = 0; k < law->branches; ++k) {
        double xi = x - lag_mm[k];
        const size_t j = (size_t)(bs_clip_(xi, table->end_mm) * per_step);
        const bs_cell *d = &table->cell[j];
        xi -= (double)j * table->step_mm;
        force += law->share[k] * (middle - (1.0 - soft * (d->g + d->dg * xi)) * (d->F_m + d->dF_m * xi));
    }
    if (force < 0.0 || stroke_mm <= 0.0)
        force = 0.0;
    if (stroke_mm > table->end_mm)
        force += law->stop_kN_per_mm * (stroke_mm - table->end_mm);
    return force;
}

/* Begin at rest at a stroke, without overstress, everything at one temperature (ambient too). */
static inline void bs_start(const bs_table *table, const bs_law *law, bs_spring *spring, double stroke_mm,
                            double band, double temperature_C)
{
    const double x = bs_clip_(stroke_mm, table->end_mm);
    const size_t i = (size_t)(x * table->per_step);
    const bs_cell *c = &table->cell[i];
    const double f = x - (double)i * table->step_mm;
    const double r = band - c->centre - c->dcentre * f;
    size_t k;
    spring->stroke_mm = stroke_mm;
    spring->band = band;
    spring->temperature_C = spring->sensor_temperature_C = spring->ambient_C = temperature_C;
    spring->work_J = spring->heat_J = spring->owed_ = 0.0;
    spring->x_ = x;
    spring->A_ = c->A + c->dA * f;
    spring->B_ = c->B + c->dB * f;
    spring->g_ = c->g + c->dg * f;
    spring->h_ = c->h + c->dh * f;
    spring->m_ = spring->h_ * r;
    spring->psi_ = 0.5 * (c->G + c->dG * f) * r * r;
    for (k = 0; k < BS_BRANCHES; ++k) {
        spring->lag_mm[k] = spring->kept_[k] = spring->added_[k] = 0.0;
        spring->inner_[k] = c->F_m + c->dF_m * f;
        spring->g_inner_[k] = spring->g_;
    }
    bs_duration_(law, spring, 0.0);
    spring->force_kN = bs_force(table, law, stroke_mm, band, spring->lag_mm, temperature_C);
}

/* Band position after a stroke of dx to where the integrals are A and B: exact for a monotone stroke. */
static inline double bs_band_after_(const bs_spring *spring, double dx, double A, double B)
{
    if (dx > 0.0 && A > spring->A_)
        return 1.0 - (1.0 - spring->band) * exp(spring->A_ - A);
    if (dx < 0.0 && B < spring->B_)
        return spring->band * exp(B - spring->B_);
    return spring->band;
}

/* The same for a stroke; changes nothing. */
static inline double bs_band_at(const bs_table *table, const bs_spring *spring, double stroke_mm)
{
    const double x = bs_clip_(stroke_mm, table->end_mm);
    const size_t i = (size_t)(x * table->per_step);
    const bs_cell *c = &table->cell[i];
    const double f = x - (double)i * table->step_mm;
    return bs_band_after_(spring, x - spring->x_, c->A + c->dA * f, c->B + c->dB * f);
}

/* One step; lag_end of the first branch, if given, is a state that somebody else has integrated. */
static inline double bs_move_(const bs_table *table, const bs_law *law, bs_spring *spring, double stroke_mm,
                              double dt_s, const double *lag_end)
{
    const double per_step = table->per_step, end = table->end_mm;
    double x, f, A, B, h, g, r, m, psi, dx, p, p_0, T, warmer, soft, s_0, s, q, force, middle;
    const bs_cell *c;
    size_t i, k;

    if (!(fabs(stroke_mm) <= BS_MOST) || !(dt_s >= 0.0 && dt_s <= BS_MOST))
        return NAN;
    if (dt_s != spring->dt_)
        bs_duration_(law, spring, dt_s);
    x = bs_clip_(stroke_mm, end);
    i = (size_t)(x * per_step);
    f = x - (double)i * table->step_mm;
    c = &table->cell[i];
    dx = x - spring->x_;
    p_0 = spring->band;
    A = c->A + c->dA * f;
    B = c->B + c->dB * f;
    p = bs_band_after_(spring, dx, A, B);
    h = c->h + c->dh * f;
    g = c->g + c->dg * f;
    r = p - c->centre - c->dcentre * f;
    m = h * r;
    psi = 0.5 * (c->G + c->dG * f) * r * r;

    /* Heat of the step, at the temperature with which it begins. */
    T = spring->temperature_C;
    warmer = T - law->reference_C;
    soft = bs_softening_(law, warmer);
    s_0 = 1.0 - soft * spring->g_;
    s = 1.0 - soft * g;
    if (law->paper_heat)
        q = dx < 0.0 ? -0.5 * (s_0 * spring->h_ * (1.0 - p_0) + s * h * (1.0 - p)) * dx : 0.0;
    else {
        q = 0.5 * (s_0 * spring->m_ + s * m) * dx - s * psi + s_0 * spring->psi_ + spring->owed_;
        spring->owed_ = q < 0.0 ? q : 0.0;
        q = q < 0.0 ? 0.0 : q;
    }
    if (law->loss_sensitivity_per_K != 0.0)
        q *= bs_width_scale_(table, law, warmer);
    for (k = 0; k < law->branches; ++k) {
        const double lag_0 = spring->lag_mm[k];
        const double lag = lag_end && k == 0 ? *lag_end : lag_0 * spring->kept_[k] + dx * spring->added_[k];
        double xi = x - lag, inner, g_in, loss;
        const size_t j = (size_t)(bs_clip_(xi, end) * per_step);
        const bs_cell *d = &table->cell[j];
        xi -= (double)j * table->step_mm;
        inner = d->F_m + d->dF_m * xi;
        g_in = d->g + d->dg * xi;
        loss = (lag_0 + lag)
               * ((1.0 - soft * g_in) * inner - (1.0 - soft * spring->g_inner_[k]) * spring->inner_[k]);
        if (loss > 0.0)
            q += 0.5 * law->share[k] * loss;
        spring->lag_mm[k] = lag;
        spring->inner_[k] = inner;
        spring->g_inner_[k] = g_in;
    }
    spring->heat_J += q;
    spring->x_ = x, spring->A_ = A, spring->B_ = B, spring->g_ = g;
    spring->h_ = h, spring->m_ = m, spring->psi_ = psi;

    /* Eq. (7); the sensor follows the mass. */
    if (!law->isothermal) {
        const double ambient = spring->ambient_C, sensed = spring->sensor_temperature_C;
        T += q * spring->per_joule_ - (T - ambient) * spring->share_;
        spring->temperature_C = T;
        spring->sensor_temperature_C =
            sensed + (ambient + law->sensor_gain * (T - ambient) - sensed) * spring->follow_;
    }

    /* Force at the new temperature, with the band position kept. */
    warmer = T - law->reference_C;
    soft = bs_softening_(law, warmer);
    s = 1.0 - soft * g;
    if (law->loss_sensitivity_per_K != 0.0)
        h *= bs_width_scale_(table, law, warmer);
    force = s * (c->F_l + c->dF_l * f - (1.0 - p) * h);
    middle = s * (c->F_m + c->dF_m * f);
    for (k = 0; k < law->branches; ++k)
        force += law->share[k] * (middle - (1.0 - soft * spring->g_inner_[k]) * spring->inner_[k]);
    if (force < 0.0 || stroke_mm <= 0.0)
        force = 0.0;
    if (stroke_mm > end)
        force += law->stop_kN_per_mm * (stroke_mm - end);
    spring->work_J += 0.5 * (spring->force_kN + force) * (stroke_mm - spring->stroke_mm);
    spring->stroke_mm = stroke_mm;
    spring->force_kN = force;
    spring->band = p;
    return force;
}

/* Go to a stroke in dt_s [s] at constant speed; get the force there [kN]. Exact for a monotone stroke. */
static inline double bs_step(const bs_table *table, const bs_law *law, bs_spring *spring, double stroke_mm,
                             double dt_s)
{
    return bs_move_(table, law, spring, stroke_mm, dt_s, NULL);
}

/* The same over a history of equal steps; force_kN may be the array of the strokes. */
static inline void bs_run(const bs_table *table, const bs_law *law, bs_spring *spring, size_t count,
                          const double *stroke_mm, double dt_s, double *force_kN)
{
    size_t k;
    for (k = 0; k < count; ++k)
        force_kN[k] = bs_step(table, law, spring, stroke_mm[k], dt_s);
}

#endif
