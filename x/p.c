/* Functions of the mechanism 'p', written by flyball 0.4.0.

       qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

   SI units and radians. World axes unless told otherwise. Velocities v are rates of the coordinates q, but
   for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x, w_y,
   w_z along the body's own axes in v. Reactions are G^T lam.
   Arguments and results are arrays of double, matrices row by row; results have to be there. Nothing is
   kept from one call to the next, so that threads may share them. Compile with a C99 compiler, link with
   -lm.

   Coordinates: joint: these make the fewest equations.
   q (1): A.angle
   v (1): A.angle'
   p (2): k, l
   kinematics: 4 operations
   velocities: 6 operations
   T: 0 operations
   M: 8 operations
   f: 16 operations
   g: 0 operations
   nu: 0 operations
   G: 0 operations
   gamma: 0 operations
   residual: 22 operations
   right_hand_side: 26 operations
   energies: 18 operations */
#include "p.h"

#include <math.h>

const char *const p_q_names[1] = {
    "A.angle",
};

const char *const p_v_names[1] = {
    "A.angle'",
};

const char *const p_p_names[2] = {
    "k", "l",
};

const double p_q_start[1] = {
    0.0,
};

const double p_v_start[1] = {
    0.0,
};

const double p_p_values[2] = {
    5.0, 0.5,
};

void p_kinematics(double t, const double *q, const double *p, double *positions, double *rotations)
{
    const double x1 = cos(q[0]);
    const double x2 = sin(q[0]);
    (void)t;
    positions[0] = p[1] * x1;
    positions[1] = p[1] * x2;
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

void p_velocities(double t, const double *q, const double *v, const double *p, double *velocities, double
    *angular_velocities)
{
    (void)t;
    velocities[0] = -v[0] * (p[1] * sin(q[0]));
    velocities[1] = v[0] * (p[1] * cos(q[0]));
    velocities[2] = 0.0;
    angular_velocities[0] = 0.0;
    angular_velocities[1] = 0.0;
    angular_velocities[2] = v[0];
}

void p_T(const double *q, const double *p, double *T)
{
    (void)q;
    (void)p;
    T[0] = 1.0;
}

void p_M(const double *q, const double *p, double *M)
{
    const double x1 = p[1] * cos(q[0]);
    const double x2 = p[1] * sin(q[0]);
    M[0] = 1.0 + (x1 * x1 + x2 * x2);
}

void p_f(double t, const double *q, const double *v, const double *p, double *f)
{
    const double x1 = p[1] * cos(q[0]);
    const double x2 = p[1] * sin(q[0]);
    const double x3 = x1 * (v[0] * (v[0] * x2) - 9.81) - x2 * (v[0] * (v[0] * x1)) - (0.5 * v[0] + p[0] * q[0]);
    (void)t;
    f[0] = x3;
}

void p_g(double t, const double *q, const double *p, double *g)
{
    (void)t;
    (void)q;
    (void)p;
    (void)g;
}

void p_nu(double t, const double *q, const double *p, double *nu)
{
    (void)t;
    (void)q;
    (void)p;
    (void)nu;
}

void p_G(double t, const double *q, const double *p, double *G)
{
    (void)t;
    (void)q;
    (void)p;
    (void)G;
}

void p_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2)
{
    (void)t;
    (void)q;
    (void)v;
    (void)p;
    (void)gamma_2;
}

void p_residual(double t, const double *q, const double *v, const double *vdot, const double *p, double
    *residual)
{
    const double x1 = p[1] * cos(q[0]);
    const double x2 = p[1] * sin(q[0]);
    const double x3 = x1 * (v[0] * (v[0] * x2) - 9.81) - x2 * (v[0] * (v[0] * x1)) - (0.5 * v[0] + p[0] * q[0]);
    (void)t;
    residual[0] = (1.0 + (x1 * x1 + x2 * x2)) * vdot[0] - x3;
}

void p_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot, double
    *vdot, double *lam)
{
    const double x1 = p[1] * cos(q[0]);
    const double x2 = p[1] * sin(q[0]);
    const double x3 = 1.0 + (x1 * x1 + x2 * x2);
    const double x4 = x1 * (v[0] * (v[0] * x2) - 9.81) - x2 * (v[0] * (v[0] * x1)) - (0.5 * v[0] + p[0] * q[0]);
    const double x5 = 1.0 / x3;
    const double x6 = x4 * x5;
    (void)t;
    qdot[0] = v[0];
    vdot[0] = x6 + x5 * (x4 - x3 * x6);
    (void)lam;
}

void p_energies(double t, const double *q, const double *v, const double *p, double *kinetic, double
    *potential)
{
    const double x1 = p[1] * sin(q[0]);
    const double x2 = v[0] * x1;
    const double x3 = v[0] * (p[1] * cos(q[0]));
    (void)t;
    kinetic[0] = 0.5 * (x2 * x2 + x3 * x3) + 0.5 * (v[0] * v[0]);
    potential[0] = 9.81 * x1 + 0.5 * (q[0] * (p[0] * q[0]));
}
