/* Functions of the mechanism 'mechanism', written by flyball 0.4.0.

       qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

   SI units and radians. World axes unless told otherwise. Velocities v are rates of the coordinates q, but
   for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x, w_y,
   w_z along the body's own axes in v. Reactions are G^T lam.
   Arguments and results are arrays of double, matrices row by row; results have to be there. Nothing is
   kept from one call to the next, so that threads may share them. Compile with a C99 compiler, link with
   -lm.

   Coordinates: absolute: no joint can be a tree joint.
   q (3): f.x, f.y, f.angle
   v (3): f.x', f.y', f.angle'
   lam (1): c.lam_xy
   kinematics: 2 operations
   velocities: 0 operations
   T: 0 operations
   M: 0 operations
   f: 0 operations
   g: 20 operations
   nu: 0 operations
   G: 8 operations
   gamma: 36 operations
   residual: 13 operations
   right_hand_side: 78 operations
   energies: 8 operations */
#include "mechanism.h"

#include <math.h>

const char *const mechanism_q_names[3] = {
    "f.x", "f.y", "f.angle",
};

const char *const mechanism_v_names[3] = {
    "f.x'", "f.y'", "f.angle'",
};

const char *const mechanism_lam_names[1] = {
    "c.lam_xy",
};

const double mechanism_q_start[3] = {
    0.0, 0.0, 0.0,
};

const double mechanism_v_start[3] = {
    0.0, 0.0, 0.0,
};

const double mechanism_places_start[1] = {
    1.0099019513592786,
};

static double minimum(double a, double b)
{
    return a <= b || a != a ? a : b;
}

/* A derivative of a piecewise cubic: period, count, breaks, and four coefficients a piece. */
static double spline(const double *data, int order, double x)
{
    const int count = (int)data[1];
    const double *breaks = data + 2;
    const double *c;
    double shift = 0.0, s;
    int low = 0, high = count;
    if (data[0] > 0.0)
        shift = data[0] * floor((x - breaks[0]) / data[0]);
    while (low < high) {
        const int middle = (low + high) / 2;
        if (breaks[middle] <= x - shift)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == count && x - shift == breaks[count - 1])
        low = count - 1;
    c = breaks + count + 4 * low;
    s = x - (breaks[low > 0 ? low - 1 : 0] + shift);
    switch (order) {
    case 0:
        return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    case 1:
        return c[1] + s * (2.0 * c[2] + 3.0 * c[3] * s);
    case 2:
        return 2.0 * c[2] + 6.0 * c[3] * s;
    default:
        return 6.0 * c[3];
    }
}

static const double table_1[] = {
    0.0, 5.0, 0.0, 0.5099019513592785, 1.0099019513592786, 1.5099019513592786, 2.0198039027185573, -1.0,
    0.9642178021067183, 0.0, 0.0, -1.0, 0.9642178021067183, 0.038583944391084465, -0.01273521135365385, -0.5,
    0.9936323943231721, 0.019102817030482326, -0.012735211353653846, 0.0, 1.003183802838414, 0.0,
    -0.012735211353655629, 0.5, 0.9936323943231723, -0.019102817030482732, -0.012735211353653846, 1.0,
    0.9642178021067175, 0.0, 0.0,
};

static const double table_2[] = {
    0.0, 5.0, 0.0, 0.5099019513592785, 1.0099019513592786, 1.5099019513592786, 2.0198039027185573, 0.1,
    -0.39415516232375347, 0.0, 0.0, 0.1, -0.39415516232375347, 0.4864351269031132, -0.19228920473856237, 0.0,
    -0.048072301184640766, 0.19228920473856298, -0.19228920473856287, 0.0, 1.7867897510954308e-17,
    -0.09614460236928145, 0.1922892047385628, 0.0, 0.04807230118464068, 0.1922892047385627, 0.19228920473856273, 0.1,
    0.39415516232375364, 0.0, 0.0,
};

void mechanism_kinematics(double t, const double *q, double *positions, double *rotations)
{
    const double x1 = cos(q[2]);
    const double x2 = sin(q[2]);
    (void)t;
    positions[0] = q[0];
    positions[1] = q[1];
    positions[2] = 0.0;
    rotations[0] = x1;
    rotations[1] = -x2;
    rotations[2] = 0.0;
    rotations[3] = x2;
    rotations[4] = x1;
    rotations[5] = 0.0;
    rotations[6] = 0.0;
    rotations[7] = 0.0;
    rotations[8] = 1.0;
}

void mechanism_velocities(double t, const double *q, const double *v, double *velocities, double
    *angular_velocities)
{
    (void)t;
    (void)q;
    velocities[0] = v[0];
    velocities[1] = v[1];
    velocities[2] = 0.0;
    angular_velocities[0] = 0.0;
    angular_velocities[1] = 0.0;
    angular_velocities[2] = v[2];
}

void mechanism_T(const double *q, double *T)
{
    (void)q;
    T[0] = 1.0;
    T[1] = 0.0;
    T[2] = 0.0;
    T[3] = 0.0;
    T[4] = 1.0;
    T[5] = 0.0;
    T[6] = 0.0;
    T[7] = 0.0;
    T[8] = 1.0;
}

void mechanism_M(const double *q, double *M)
{
    (void)q;
    M[0] = 1.0;
    M[1] = 0.0;
    M[2] = 0.0;
    M[3] = 0.0;
    M[4] = 1.0;
    M[5] = 0.0;
    M[6] = 0.0;
    M[7] = 0.0;
    M[8] = 1.0;
}

void mechanism_f(double t, const double *q, const double *v, double *f)
{
    (void)t;
    (void)q;
    (void)v;
    f[0] = 0.0;
    f[1] = -9.81;
    f[2] = 0.0;
}

void mechanism_g(double t, const double *q, const double *places, double *g)
{
    const double x1 = spline(table_1, 1, places[0]);
    const double x2 = spline(table_2, 1, places[0]);
    const double x3 = sqrt(x1 * x1 + x2 * x2);
    const double x4 = (q[0] - spline(table_1, 0, places[0])) * (x2 / x3) - (q[1] - spline(table_2, 0, places[0])) * (x1 / x3);
    const double x5 = 2.019803902718557e-09 + minimum(places[0], 2.0198039027185573 - places[0]);
    (void)t;
    g[0] = x4 + (x5 > 0.0 ? 0.0 : NAN);
}

void mechanism_nu(double t, const double *q, double *nu)
{
    (void)t;
    (void)q;
    nu[0] = 0.0;
}

void mechanism_G(double t, const double *q, const double *places, double *G)
{
    const double x1 = spline(table_1, 1, places[0]);
    const double x2 = spline(table_2, 1, places[0]);
    const double x3 = sqrt(x1 * x1 + x2 * x2);
    (void)t;
    (void)q;
    G[0] = x2 / x3;
    G[1] = -x1 / x3;
    G[2] = 0.0;
}

void mechanism_gamma(double t, const double *q, const double *v, const double *places, double *gamma_2)
{
    const double x1 = spline(table_1, 1, places[0]);
    const double x2 = spline(table_2, 1, places[0]);
    const double x3 = sqrt(x1 * x1 + x2 * x2);
    const double x4 = x2 / x3;
    const double x5 = x1 / x3;
    const double x6 = (q[0] - spline(table_1, 0, places[0])) * x4 - (q[1] - spline(table_2, 0, places[0])) * x5;
    const double x7 = x1 * spline(table_2, 2, places[0]) - spline(table_1, 2, places[0]) * x2;
    const double x8 = x7 / (x3 * (x3 * x3));
    const double x9 = v[0] * x5 + v[1] * x4;
    const double x10 = 2.019803902718557e-09 + minimum(places[0], 2.0198039027185573 - places[0]);
    (void)t;
    gamma_2[0] = -((x10 > 0.0 ? 0.0 : NAN) + x9 * (x8 * x9) / (1.0 + x6 * x8));
}

void mechanism_residual(double t, const double *q, const double *v, const double *vdot, const double *lam,
    const double *places, double *residual)
{
    const double x1 = spline(table_1, 1, places[0]);
    const double x2 = spline(table_2, 1, places[0]);
    const double x3 = sqrt(x1 * x1 + x2 * x2);
    (void)t;
    (void)q;
    (void)v;
    residual[0] = vdot[0] - lam[0] * (x2 / x3);
    residual[1] = vdot[1] + 9.81 + lam[0] * (x1 / x3);
    residual[2] = vdot[2];
}

void mechanism_right_hand_side(double t, const double *q, const double *v, const double *places, double *qdot,
    double *vdot, double *lam, double *placesdot)
{
    const double x1 = spline(table_1, 1, places[0]);
    const double x2 = spline(table_2, 1, places[0]);
    const double x3 = sqrt(x1 * x1 + x2 * x2);
    const double x4 = x2 / x3;
    const double x5 = x1 / x3;
    const double x6 = (q[0] - spline(table_1, 0, places[0])) * x4 - (q[1] - spline(table_2, 0, places[0])) * x5;
    const double x7 = x1 * spline(table_2, 2, places[0]) - spline(table_1, 2, places[0]) * x2;
    const double x8 = x7 / (x3 * (x3 * x3));
    const double x9 = v[0] * x5 + v[1] * x4;
    const double x10 = 1.0 + x6 * x8;
    const double x11 = 2.019803902718557e-09 + minimum(places[0], 2.0198039027185573 - places[0]);
    const double x12 = (x11 > 0.0 ? 0.0 : NAN) + x9 * (x8 * x9) / x10;
    const double x13 = 1.0 / (x4 * x4 + x5 * x5);
    const double x14 = -x13 * (x12 + 9.81 * x5);
    const double x15 = x4 * x14;
    const double x16 = -(9.81 + 0.9999999989999 * (x5 * x14));
    const double x17 = -x13 * (x12 + (0.9999999989999 * (x4 * x15) - x5 * x16));
    const double x18 = 0.9999999989999 * x15 + 0.9999999989999 * (x4 * x17);
    const double x19 = x16 - 0.9999999989999 * (x5 * x17);
    const double x20 = -x13 * (x12 + (x4 * x18 - x5 * x19));
    const double x21 = 0.9999999989999 * x14 + 0.9999999989999 * x17 + 0.9999999989999 * x20;
    (void)t;
    qdot[0] = v[0];
    qdot[1] = v[1];
    qdot[2] = v[2];
    vdot[0] = x18 + 0.9999999989999 * (x4 * x20);
    vdot[1] = x19 - 0.9999999989999 * (x5 * x20);
    vdot[2] = 0.0;
    lam[0] = x21;
    placesdot[0] = x9 / x10 / x3;
}

void mechanism_energies(double t, const double *q, const double *v, double *kinetic, double *potential)
{
    (void)t;
    kinetic[0] = 0.5 * (v[0] * v[0] + v[1] * v[1]) + 0.5 * (v[2] * v[2]);
    potential[0] = 9.81 * q[1];
}
