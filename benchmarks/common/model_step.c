/* The same steps as plain C loops, for benchmarks/model.py: what a compiler makes of them with -O2.

   Rows as in model/kernels.py: 16 figures a cell, law, factors, state. */

#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* Force of a stroke history at one temperature, viscous branches left out. */
void isothermal(const double *cells, const double *law, double soft, double e, double p, size_t n,
                const double *strokes, double *force)
{
    const double per_step = law[0], cell_mm = law[1], end = law[2], stop = law[8];
    double x_0 = 0.0, A_0 = 0.0, B_0 = 0.0;
    for (size_t k = 0; k < n; k++) {
        const double stroke = strokes[k];
        const double x = stroke < 0.0 ? 0.0 : stroke < end ? stroke : end;
        const int64_t i = (int64_t)(x * per_step);
        const double f = x - i * cell_mm;
        const double *c = cells + 16 * i;
        const double A = c[0] + c[1] * f, B = c[2] + c[3] * f;
        if (k > 0) {
            if (x > x_0) {
                if (A > A_0) p = 1.0 - (1.0 - p) * exp(A_0 - A);
            } else if (x < x_0 && B < B_0) {
                p *= exp(B - B_0);
            }
        }
        const double s = 1.0 - soft * (c[14] + c[15] * f);
        double F = s * (c[4] + c[5] * f - (1.0 - p) * e * (c[6] + c[7] * f));
        if (F < 0.0 || stroke <= 0.0) F = 0.0;
        if (stroke > end) F += stop * (stroke - end);
        force[k] = F;
        x_0 = x, A_0 = A, B_0 = B;
    }
}

enum { STROKE, FORCE, BAND, TEMPERATURE, SENSOR, WORK, HEAT, AMBIENT,
       OWED, INSIDE, LAST_A, LAST_B, DEPTH, WIDTH, EXCESS, FREE_ENERGY, INNER, READ = 7 };

static double clipped(double e, double most) { return e < 0.0 ? 0.0 : e < most ? e : most; }

/* The whole step with heat and viscous branches: model/kernels.py, drive(). */
void drive(const double *all_cells, const double *laws, const double *all_factors, double *states,
           const int64_t *places, size_t n, const double *strokes, double *outputs)
{
    for (size_t k = 0; k < n; k++) {
        const double *cells = all_cells + places[4 * k], *law = laws + places[4 * k + 1];
        const double *factors = all_factors + places[4 * k + 2];
        double *state = states + places[4 * k + 3];
        const double stroke = strokes[k], per_step = law[0], cell_mm = law[1], end = law[2];
        const double x = stroke < 0.0 ? 0.0 : stroke < end ? stroke : end;
        const int64_t i = (int64_t)(x * per_step);
        const double f = x - i * cell_mm;
        const double *c = cells + 16 * i;
        const double dx = x - state[INSIDE], p_0 = state[BAND];
        double p = p_0;
        const double A = c[0] + c[1] * f, B = c[2] + c[3] * f;
        if (dx > 0.0) {
            if (state[LAST_A] < A) p = 1.0 - (1.0 - p) * exp(state[LAST_A] - A);
        } else if (dx < 0.0 && state[LAST_B] > B) {
            p *= exp(B - state[LAST_B]);
        }
        double h = c[6] + c[7] * f;
        const double g = c[14] + c[15] * f, r = p - c[10] - c[11] * f, m = h * r;
        const double psi = 0.5 * (c[12] + c[13] * f) * r * r;

        double T = state[TEMPERATURE], warmer = T - law[3];
        double soft = warmer < law[6] ? law[4] * warmer : law[7];
        const double s_0 = 1.0 - soft * state[DEPTH];
        double s = 1.0 - soft * g, q = 0.0;
        if (law[9] != 0.0) {
            if (dx < 0.0) q = -0.5 * (s_0 * state[WIDTH] * (1.0 - p_0) + s * h * (1.0 - p)) * dx;
        } else {
            q = 0.5 * (s_0 * state[EXCESS] + s * m) * dx - s * psi + s_0 * state[FREE_ENERGY];
            q += state[OWED];
            state[OWED] = 0.0;
            if (q < 0.0) {
                state[OWED] = q;
                q = 0.0;
            }
        }
        if (law[5] != 0.0) q *= clipped(1.0 - law[5] * warmer, law[11]);
        const int64_t branches = (int64_t)law[12];
        for (int64_t b = 0; b < branches; b++) {
            double *own = state + INNER + 3 * b;
            const double lag = own[0] * factors[3 + 2 * b] + dx * factors[4 + 2 * b];
            double xi = x - lag;
            const int64_t j = (int64_t)(xi * per_step);
            const double *o = cells + 16 * j;
            xi -= j * cell_mm;
            const double inner = o[8] + o[9] * xi, g_in = o[14] + o[15] * xi;
            const double loss = (own[0] + lag) * ((1.0 - soft * g_in) * inner - (1.0 - soft * own[2]) * own[1]);
            if (loss > 0.0) q += 0.5 * law[13 + b] * loss;
            own[0] = lag, own[1] = inner, own[2] = g_in;
        }
        state[HEAT] += q;
        const double ambient = state[AMBIENT], sensed = state[SENSOR];
        T += q * factors[1] - (T - ambient) * factors[0];
        state[TEMPERATURE] = T;
        state[SENSOR] = sensed + (ambient + law[10] * (T - ambient) - sensed) * factors[2];
        state[INSIDE] = x, state[LAST_A] = A, state[LAST_B] = B;
        state[DEPTH] = g, state[WIDTH] = h, state[EXCESS] = m, state[FREE_ENERGY] = psi;

        warmer = T - law[3];
        soft = warmer < law[6] ? law[4] * warmer : law[7];
        s = 1.0 - soft * g;
        if (law[5] != 0.0) h *= clipped(1.0 - law[5] * warmer, law[11]);
        double F = s * (c[4] + c[5] * f - (1.0 - p) * h);
        const double middle = s * (c[8] + c[9] * f);
        for (int64_t b = 0; b < branches; b++) {
            const double *own = state + INNER + 3 * b;
            F += law[13 + b] * (middle - (1.0 - soft * own[2]) * own[1]);
        }
        if (F < 0.0 || stroke <= 0.0) F = 0.0;
        if (stroke > end) F += law[8] * (stroke - end);
        state[WORK] += 0.5 * (state[FORCE] + F) * (stroke - state[STROKE]);
        state[STROKE] = stroke, state[FORCE] = F, state[BAND] = p;
        for (int64_t j = 0; j < READ; j++) outputs[READ * k + j] = state[j];
    }
}
