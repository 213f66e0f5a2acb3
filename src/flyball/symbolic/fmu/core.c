/* Projection onto the constraints, and integration by the pair of Dormand and Prince. */
#include "core.h"

#include <math.h>
#include <string.h>

#define PROJECTIONS 20    /* Newton steps at most */
#define LEAST_GAIN 0.5    /* a step that is not shorter than this part of the one before ends the projection */
#define REGULARIZATION 1e-10 /* of redundant constraints, relative to the response of their row */
#define SHORTEST_STEP 1e-12  /* relative to the communication step */

#define STATE(s) ((s)->value + 1)
#define RATE(s) ((s)->value + RATES_AT)
#define INPUT(s) ((s)->value + INPUTS_AT)
#define PARAMETER(s) ((s)->value + PARAMETERS_AT)

void reset_instance(Instance *s)
{
    memset(s, 0, sizeof *s);
    memcpy(STATE(s), start_states, sizeof(double) * NX);
    memcpy(PARAMETER(s), start_parameters, sizeof(double) * NP);
    s->tolerance = 1e-6;
    s->initializing = 1;
}

void set_value(Instance *s, size_t k, double value)
{
    s->value[k] = value;
    s->current = 0;
}

/* Inputs may be set at any time; states and parameters only before the motion begins. */
int may_be_set(const Instance *s, size_t k)
{
    const int input = k >= INPUTS_AT && k < PARAMETERS_AT;
    return input || (s->initializing && ((k > 0 && k < RATES_AT) || (k >= PARAMETERS_AT && k < OUTPUTS_AT)));
}

void update_values(Instance *s)
{
    if (s->current)
        return;
    call_rates(s->value[0], STATE(s), INPUT(s), PARAMETER(s), RATE(s));
    call_outputs(s->value[0], STATE(s), INPUT(s), PARAMETER(s), s->value + OUTPUTS_AT);
    s->current = 1;
}

#if NR > 0
/* Solve the dense equations A x = b by Gaussian elimination with partial pivoting; b becomes x. */
static void solve(double *A, double *b, int n)
{
    for (int k = 0; k < n; k++) {
        int row = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(A[i * n + k]) > fabs(A[row * n + k]))
                row = i;
        for (int j = 0; j < n; j++) {
            const double x = A[k * n + j];
            A[k * n + j] = A[row * n + j];
            A[row * n + j] = x;
        }
        const double x = b[k];
        b[k] = b[row];
        b[row] = x;
        if (A[k * n + k] == 0.0)
            continue;
        for (int i = k + 1; i < n; i++) {
            const double factor = A[i * n + k] / A[k * n + k];
            for (int j = k; j < n; j++)
                A[i * n + j] -= factor * A[k * n + j];
            b[i] -= factor * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= A[k * n + j] * b[j];
        b[k] = A[k * n + k] == 0.0 ? 0.0 : b[k] / A[k * n + k];
    }
}

/* The change of velocities of least kinetic energy with G change = right: [M G^T; G -delta] [change; mu] = [0; right]. */
static void least_change(const double *q, const double *p, double t, const double *right, double *change)
{
    enum { N = NV + NR };
    static const double regularization = REGULARIZATION;
    double M[NV * NV], G[NR * NV], A[N * N], b[N];
    call_M(q, p, M);
    call_G(t, q, p, G);
    memset(A, 0, sizeof A);
    memset(b, 0, sizeof b);
    for (int i = 0; i < NV; i++)
        memcpy(A + i * N, M + i * NV, sizeof(double) * NV);
    for (int k = 0; k < NR; k++) {
        double response = 0.0;
        for (int d = 0; d < NV; d++) {
            A[(NV + k) * N + d] = A[d * N + NV + k] = G[k * NV + d];
            if (M[d * NV + d] > 0.0)
                response += G[k * NV + d] * G[k * NV + d] / M[d * NV + d];
        }
        A[(NV + k) * N + NV + k] = -regularization * (response > 0.0 ? response : 1.0);
        b[NV + k] = right[k];
    }
    solve(A, b, N);
    memcpy(change, b, sizeof(double) * NV);
}

static double size_of(const double *change)
{
    double most = 0.0;
    for (int d = 0; d < NV; d++)
        most = fmax(most, fabs(change[d]) / velocity_sizes[d]);
    return most;
}
#endif

/* Normalise the unit quaternions. */
static void normalise(double *q)
{
    for (int k = 0; quaternions[k] >= 0; k++) {
        double *e = q + quaternions[k];
        const double size = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
        for (int i = 0; i < 4; i++)
            e[i] /= size;
    }
}

/* Move positions and velocities onto the constraints, along M^-1 G^T; returns the change of positions in their sizes. */
double project(Instance *s)
{
    double moved = 0.0;
    normalise(STATE(s));
#if NR > 0
    double *q = STATE(s), *v = q + NQ, *p = PARAMETER(s);
    double before = INFINITY, change[NV], right[NR], G[NR * NV], T[NQ * NV];
    for (int step = 0; step < PROJECTIONS; step++) {
        call_g(s->value[0], q, p, right);
        for (int k = 0; k < NR; k++)
            right[k] = -right[k];
        least_change(q, p, s->value[0], right, change);
        const double size = size_of(change);
        if (!(size < LEAST_GAIN * before))
            break;
        call_T(q, p, T);
        for (int i = 0; i < NQ; i++)
            for (int d = 0; d < NV; d++)
                q[i] += T[i * NV + d] * change[d];
        normalise(q);
        moved += size;
        before = size;
    }
    before = INFINITY;
    for (int step = 0; step < PROJECTIONS; step++) {
        call_nu(s->value[0], q, p, right);
        call_G(s->value[0], q, p, G);
        for (int k = 0; k < NR; k++)
            for (int d = 0; d < NV; d++)
                right[k] -= G[k * NV + d] * v[d];
        least_change(q, p, s->value[0], right, change);
        const double size = size_of(change);
        if (!(size < LEAST_GAIN * before))
            break;
        for (int d = 0; d < NV; d++)
            v[d] += change[d];
        before = size;
    }
#endif
    s->current = 0;
    return moved;
}

/* Coefficients of Dormand and Prince (1980), order 5 with an embedded solution of order 4. */
static const double C[7] = {0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
static const double A[7][6] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
static const double E[7] = {
    71.0 / 57600, 0.0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40,
};

/* One step of length h to the state ``to``; returns its error relative to the tolerance. */
static double try_step(const Instance *s, double h, double *to)
{
    double k[7][NX + 1], at[NX + 1], sum = 0.0;
    for (int stage = 0; stage < 7; stage++) {
        for (int i = 0; i < NX; i++) {
            at[i] = STATE(s)[i];
            for (int j = 0; j < stage; j++)
                at[i] += h * A[stage][j] * k[j][i];
        }
        call_rates(s->value[0] + C[stage] * h, at, INPUT(s), PARAMETER(s), k[stage]);
    }
    for (int i = 0; i < NX; i++) {
        double error = 0.0;
        for (int j = 0; j < 7; j++)
            error += h * E[j] * k[j][i];
        error /= s->tolerance * (fabs(at[i]) + 0.01 * state_sizes[i]);
        sum += error * error;
        to[i] = at[i];
    }
    return NX ? sqrt(sum / NX) : 0.0;
}

/* Integrate up to a time, with error control and a projection after each step; returns 0, or 1 if steps become too short. */
int integrate(Instance *s, double end)
{
    const double whole = end - s->value[0];
    double to[NX + 1];
    if (!(whole > 0.0))
        return 0;
    if (!(s->step > 0.0))
        s->step = whole / 10.0;
    while (s->value[0] < end) {
        const int last = s->step >= end - s->value[0];
        const double h = last ? end - s->value[0] : s->step;
        const double error = try_step(s, h, to);
        if (error <= 1.0) {
            memcpy(STATE(s), to, sizeof(double) * NX);
            s->value[0] = last ? end : s->value[0] + h;
            project(s);
        }
        const double factor = error > 0.0 ? fmin(5.0, fmax(0.2, 0.9 * pow(error, -0.2))) : 5.0;
        if (error == error && !(last && error <= 1.0 && factor * h < s->step))
            s->step = h * factor;
        else if (error != error)
            s->step = 0.2 * h;
        if (s->step < SHORTEST_STEP * whole)
            return 1;
    }
    s->current = 0;
    return 0;
}
