/* Functions of the mechanism 'slider crank', written by flyball 0.4.0.

       qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

   SI units and radians. World axes unless stated otherwise. Velocities v are rates of the coordinates q,
   but for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x,
   w_y, w_z along the body's own axes in v. Reactions are G^T lam.
   Arguments and results are arrays of double, matrices row by row; results must be allocated by the caller.
   The functions have no static data, so threads may share them. Compile with a C99 compiler, link with -lm.

   Coordinates: joint: these make the fewest equations; loops are cut at C.
   q (3): A.angle, B.angle, D.displacement
   v (3): A.angle', B.angle', D.displacement'
   lam (3): C.lam_nx, C.lam_ny, motor.effort
   p (3): speed, crank, rod
   kinematics: 24 operations
   velocities: 30 operations
   T: 0 operations
   M: 56 operations
   f: 73 operations
   g: 29 operations
   nu: 0 operations
   G: 27 operations
   gamma: 42 operations
   residual: 134 operations
   right_hand_side: 322 operations
   energies: 64 operations */
#include "slider_crank.h"

#include <math.h>

const char *const slider_crank_q_names[3] = {
    "A.angle", "B.angle", "D.displacement",
};

const char *const slider_crank_v_names[3] = {
    "A.angle'", "B.angle'", "D.displacement'",
};

const char *const slider_crank_lam_names[3] = {
    "C.lam_nx", "C.lam_ny", "motor.effort",
};

const char *const slider_crank_p_names[3] = {
    "speed", "crank", "rod",
};

const double slider_crank_q_start[3] = {
    0.0, 0.0, 0.0,
};

const double slider_crank_v_start[3] = {
    10.000736613927508, -14.001031259498523, 0.0,
};

const double slider_crank_p_values[3] = {
    10.000736613927508, 0.2, 0.5,
};

void slider_crank_kinematics(double t, const double *q, const double *p, double *positions, double *rotations)
{
    const double x1 = p[1] - (p[1] + 0.5 * p[2]);
    const double x2 = cos(q[0]);
    const double x3 = sin(q[0]);
    const double x4 = p[1] * x2;
    const double x5 = p[1] * x3;
    const double x6 = cos(q[1]);
    const double x7 = sin(q[1]);
    const double x8 = x2 * x6 - x3 * x7;
    const double x9 = x3 * x6;
    const double x10 = x2 * x7;
    const double x11 = x9 + x10;
    (void)t;
    positions[0] = 0.5 * x4;
    positions[1] = 0.5 * x5;
    positions[2] = 0.0;
    positions[3] = x4 - x1 * x8;
    positions[4] = x5 - x1 * x11;
    positions[5] = 0.0;
    positions[6] = p[1] + p[2] + q[2];
    positions[7] = 0.0;
    positions[8] = 0.0;
    rotations[0] = x2;
    rotations[1] = -x3;
    rotations[2] = 0.0;
    rotations[3] = x3;
    rotations[4] = x2;
    rotations[5] = 0.0;
    rotations[6] = 0.0;
    rotations[7] = 0.0;
    rotations[8] = 1.0;
    rotations[9] = x8;
    rotations[10] = -(x9 + x10);
    rotations[11] = 0.0;
    rotations[12] = x11;
    rotations[13] = x8;
    rotations[14] = 0.0;
    rotations[15] = 0.0;
    rotations[16] = 0.0;
    rotations[17] = 1.0;
    rotations[18] = 1.0;
    rotations[19] = 0.0;
    rotations[20] = 0.0;
    rotations[21] = 0.0;
    rotations[22] = 1.0;
    rotations[23] = 0.0;
    rotations[24] = 0.0;
    rotations[25] = 0.0;
    rotations[26] = 1.0;
}

void slider_crank_velocities(double t, const double *q, const double *v, const double *p, double *velocities,
    double *angular_velocities)
{
    const double x1 = p[1] - (p[1] + 0.5 * p[2]);
    const double x2 = cos(q[0]);
    const double x3 = sin(q[0]);
    const double x4 = p[1] * x2;
    const double x5 = p[1] * x3;
    const double x6 = cos(q[1]);
    const double x7 = sin(q[1]);
    const double x8 = v[0] * x5;
    const double x9 = v[0] * x4;
    const double x10 = v[0] + v[1];
    (void)t;
    velocities[0] = -0.5 * x8;
    velocities[1] = 0.5 * x9;
    velocities[2] = 0.0;
    velocities[3] = -(x8 + x10 * (x5 - x1 * (x3 * x6 + x2 * x7) - x5));
    velocities[4] = x9 + x10 * (x4 - x1 * (x2 * x6 - x3 * x7) - x4);
    velocities[5] = 0.0;
    velocities[6] = v[2];
    velocities[7] = 0.0;
    velocities[8] = 0.0;
    angular_velocities[0] = 0.0;
    angular_velocities[1] = 0.0;
    angular_velocities[2] = v[0];
    angular_velocities[3] = 0.0;
    angular_velocities[4] = 0.0;
    angular_velocities[5] = x10;
    angular_velocities[6] = 0.0;
    angular_velocities[7] = 0.0;
    angular_velocities[8] = 0.0;
}

void slider_crank_T(const double *q, const double *p, double *T)
{
    (void)q;
    (void)p;
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

void slider_crank_M(const double *q, const double *p, double *M)
{
    const double x1 = p[1] - (p[1] + 0.5 * p[2]);
    const double x2 = cos(q[0]);
    const double x3 = sin(q[0]);
    const double x4 = p[1] * x2;
    const double x5 = p[1] * x3;
    const double x6 = cos(q[1]);
    const double x7 = sin(q[1]);
    const double x8 = x4 - x1 * (x2 * x6 - x3 * x7) - x4;
    const double x9 = x5 - x1 * (x3 * x6 + x2 * x7) - x5;
    const double x10 = 0.08333333333333333 * (p[1] * p[1]) + (0.25 * (x4 * x4) + 0.25 * (x5 * x5));
    const double x11 = 0.125 * (p[2] * p[2]) + (1.5 * (x8 * x8) + 1.5 * (x9 * x9));
    const double x12 = 2.0 * (x4 * (1.5 * x8 + 0.75 * x4)) + 2.0 * (x5 * (1.5 * x9 + 0.75 * x5));
    const double x13 = x11 + (1.5 * (x4 * x8) + 1.5 * (x5 * x9));
    M[0] = x10 + (x11 + x12);
    M[1] = x13;
    M[2] = 0.0;
    M[3] = x13;
    M[4] = x11;
    M[5] = 0.0;
    M[6] = 0.0;
    M[7] = 0.0;
    M[8] = 1.0;
}

void slider_crank_f(double t, const double *q, const double *v, const double *p, double *f)
{
    const double x1 = p[1] - (p[1] + 0.5 * p[2]);
    const double x2 = cos(q[0]);
    const double x3 = sin(q[0]);
    const double x4 = p[1] * x2;
    const double x5 = p[1] * x3;
    const double x6 = cos(q[1]);
    const double x7 = sin(q[1]);
    const double x8 = x4 - x1 * (x2 * x6 - x3 * x7);
    const double x9 = x5 - x1 * (x3 * x6 + x2 * x7);
    const double x10 = v[0] * (v[0] * x4);
    const double x11 = v[0] * (v[0] * x5);
    const double x12 = v[0] + v[1];
    const double x13 = x8 - x4;
    const double x14 = x9 - x5;
    const double x15 = -(x10 + x12 * (x12 * x13));
    const double x16 = x11 + x12 * (x12 * x14) - 9.81;
    const double x17 = p[1] + p[2] + q[2] - 1.2;
    const double x18 = sqrt(x17 * x17);
    const double x19 = 1.5 * (x16 * (x8 - 0.5 * x4)) + 1.5 * (x15 * (x9 - 0.5 * x5));
    const double x20 = 0.5 * (x4 * (0.5 * x11 - 9.81 + 1.5 * x16)) - 0.5 * (x5 * (0.5 * x10 - 1.5 * x15));
    (void)t;
    f[0] = x19 + x20;
    f[1] = 1.5 * (x13 * x16) + 1.5 * (x14 * x15);
    f[2] = -(x17 * (1.0 / x18) * (v[2] * x17 / x18 - 100.0) + 200.0 * x17);
}

void slider_crank_g(double t, const double *q, const double *p, double *g)
{
    const double x1 = p[1] + 0.5 * p[2];
    const double x2 = p[1] + p[2];
    const double x3 = x2 - x1;
    const double x4 = p[1] - x1;
    const double x5 = cos(q[0]);
    const double x6 = sin(q[0]);
    const double x7 = cos(q[1]);
    const double x8 = sin(q[1]);
    const double x9 = x5 * x7 - x6 * x8;
    const double x10 = x6 * x7 + x5 * x8;
    g[0] = x2 + q[2] - (p[1] * x5 - x4 * x9 + x3 * x9);
    g[1] = -(p[1] * x6 - x4 * x10 + x3 * x10);
    g[2] = q[0] - p[0] * t;
}

void slider_crank_nu(double t, const double *q, const double *p, double *nu)
{
    (void)t;
    (void)q;
    nu[0] = 0.0;
    nu[1] = 0.0;
    nu[2] = p[0];
}

void slider_crank_G(double t, const double *q, const double *p, double *G)
{
    const double x1 = p[1] + 0.5 * p[2];
    const double x2 = p[1] + p[2] - x1;
    const double x3 = p[1] - x1;
    const double x4 = cos(q[0]);
    const double x5 = sin(q[0]);
    const double x6 = p[1] * x4;
    const double x7 = p[1] * x5;
    const double x8 = cos(q[1]);
    const double x9 = sin(q[1]);
    const double x10 = x4 * x8 - x5 * x9;
    const double x11 = x5 * x8 + x4 * x9;
    const double x12 = x6 - x3 * x10 + x2 * x10;
    const double x13 = x7 - x3 * x11 + x2 * x11;
    (void)t;
    G[0] = x13;
    G[1] = x13 - x7;
    G[2] = 1.0;
    G[3] = -x12;
    G[4] = -(x12 - x6);
    G[5] = 0.0;
    G[6] = 1.0;
    G[7] = 0.0;
    G[8] = 0.0;
}

void slider_crank_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2)
{
    const double x1 = p[1] + 0.5 * p[2];
    const double x2 = p[1] + p[2] - x1;
    const double x3 = p[1] - x1;
    const double x4 = cos(q[0]);
    const double x5 = sin(q[0]);
    const double x6 = p[1] * x4;
    const double x7 = p[1] * x5;
    const double x8 = cos(q[1]);
    const double x9 = sin(q[1]);
    const double x10 = x4 * x8 - x5 * x9;
    const double x11 = x5 * x8 + x4 * x9;
    const double x12 = v[0] + v[1];
    const double x13 = -(v[0] * (v[0] * x6) + x12 * (x12 * (x6 - x3 * x10 - x6)) + x12 * (x2 * x10 * x12));
    const double x14 = -(v[0] * (v[0] * x7) + x12 * (x12 * (x7 - x3 * x11 - x7)) + x12 * (x2 * x11 * x12));
    (void)t;
    gamma_2[0] = x13;
    gamma_2[1] = x14;
    gamma_2[2] = 0.0;
}

void slider_crank_residual(double t, const double *q, const double *v, const double *vdot, const double *lam,
    const double *p, double *residual)
{
    const double x1 = p[1] + 0.5 * p[2];
    const double x2 = p[1] + p[2];
    const double x3 = x2 - x1;
    const double x4 = p[1] - x1;
    const double x5 = cos(q[0]);
    const double x6 = sin(q[0]);
    const double x7 = p[1] * x5;
    const double x8 = p[1] * x6;
    const double x9 = cos(q[1]);
    const double x10 = sin(q[1]);
    const double x11 = x5 * x9 - x6 * x10;
    const double x12 = x6 * x9 + x5 * x10;
    const double x13 = x7 - x4 * x11;
    const double x14 = x8 - x4 * x12;
    const double x15 = x13 + x3 * x11;
    const double x16 = x14 + x3 * x12;
    const double x17 = v[0] * (v[0] * x7);
    const double x18 = v[0] * (v[0] * x8);
    const double x19 = v[0] + v[1];
    const double x20 = x13 - x7;
    const double x21 = x14 - x8;
    const double x22 = -(x17 + x19 * (x19 * x20));
    const double x23 = x18 + x19 * (x19 * x21) - 9.81;
    const double x24 = x2 + q[2] - 1.2;
    const double x25 = sqrt(x24 * x24);
    const double x26 = 1.5 * (x23 * (x13 - 0.5 * x7)) + 1.5 * (x22 * (x14 - 0.5 * x8));
    const double x27 = 0.5 * (x7 * (0.5 * x18 - 9.81 + 1.5 * x23)) - 0.5 * (x8 * (0.5 * x17 - 1.5 * x22));
    const double x28 = 0.08333333333333333 * (p[1] * p[1]) + (0.25 * (x7 * x7) + 0.25 * (x8 * x8));
    const double x29 = 0.125 * (p[2] * p[2]) + (1.5 * (x20 * x20) + 1.5 * (x21 * x21));
    const double x30 = 2.0 * (x7 * (1.5 * x20 + 0.75 * x7)) + 2.0 * (x8 * (1.5 * x21 + 0.75 * x8));
    const double x31 = x29 + (1.5 * (x7 * x20) + 1.5 * (x8 * x21));
    const double x32 = x31 * vdot[0] + x29 * vdot[1] - (1.5 * (x20 * x23) + 1.5 * (x21 * x22));
    const double x33 = x24 * (1.0 / x25) * (v[2] * x24 / x25 - 100.0) + 200.0 * x24 + vdot[2];
    const double x34 = (x28 + (x29 + x30)) * vdot[0] + x31 * vdot[1] - (x26 + x27) - (lam[2] + (lam[0] * x16 - lam[1] * x15));
    (void)t;
    residual[0] = x34;
    residual[1] = x32 - (lam[0] * (x16 - x8) - lam[1] * (x15 - x7));
    residual[2] = x33 - lam[0];
}

void slider_crank_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot,
    double *vdot, double *lam)
{
    const double x1 = p[1] + 0.5 * p[2];
    const double x2 = p[1] + p[2];
    const double x3 = x2 - x1;
    const double x4 = p[1] - x1;
    const double x5 = sqrt(x4 * x4);
    const double x6 = cos(q[0]);
    const double x7 = sin(q[0]);
    const double x8 = p[1] * x6;
    const double x9 = p[1] * x7;
    const double x10 = cos(q[1]);
    const double x11 = sin(q[1]);
    const double x12 = x6 * x10 - x7 * x11;
    const double x13 = x7 * x10 + x6 * x11;
    const double x14 = x8 - x4 * x12;
    const double x15 = x9 - x4 * x13;
    const double x16 = x3 * x12;
    const double x17 = x3 * x13;
    const double x18 = x14 + x16;
    const double x19 = x15 + x17;
    const double x20 = x18 - x8;
    const double x21 = x19 - x9;
    const double x22 = v[0] * (v[0] * x8);
    const double x23 = v[0] * (v[0] * x9);
    const double x24 = v[0] + v[1];
    const double x25 = x14 - x8;
    const double x26 = x15 - x9;
    const double x27 = -(x22 + x24 * (x24 * x25));
    const double x28 = -(x23 + x24 * (x24 * x26));
    const double x29 = x27 - x24 * (x16 * x24);
    const double x30 = x28 - x24 * (x17 * x24);
    const double x31 = -(9.81 + x28);
    const double x32 = x2 + q[2] - 1.2;
    const double x33 = sqrt(x32 * x32);
    const double x34 = x32 * (1.0 / x33) * (v[2] * x32 / x33 - 100.0) + 200.0 * x32;
    const double x35 = 1.5 * (x25 * x31) + 1.5 * (x26 * x27);
    const double x36 = 1.5 * (x31 * (x14 - 0.5 * x8)) + 1.5 * (x27 * (x15 - 0.5 * x9));
    const double x37 = 0.5 * (x8 * (0.5 * x23 - 9.81 + 1.5 * x31)) - 0.5 * (x9 * (0.5 * x22 - 1.5 * x27));
    const double x38 = x36 + x37;
    const double x39 = 0.08333333333333333 * (p[1] * p[1]) + (0.25 * (x8 * x8) + 0.25 * (x9 * x9));
    const double x40 = 0.125 * (p[2] * p[2]) + (1.5 * (x25 * x25) + 1.5 * (x26 * x26));
    const double x41 = 2.0 * (x8 * (1.5 * x25 + 0.75 * x8)) + 2.0 * (x9 * (1.5 * x26 + 0.75 * x9));
    const double x42 = x39 + (x40 + x41);
    const double x43 = x40 + (1.5 * (x8 * x25) + 1.5 * (x9 * x26));
    const double x44 = x5 * x5;
    const double x45 = 1.0 / (2.0 / x42);
    const double x46 = -1.0 / (1.0 + 1e-09 * (2.0 + (x21 * x21 + x44) / x40));
    const double x47 = x19 * x46;
    const double x48 = 1.0 / (x42 + 999999999.9999999 * x45 - x19 * x47);
    const double x49 = x43 - x21 * x47;
    const double x50 = x21 * x46;
    const double x51 = x48 * x49;
    const double x52 = 1.0 / (x40 - x21 * x50 - x49 * x51);
    const double x53 = x18 * x51 - x20;
    const double x54 = x18 * x48;
    const double x55 = x52 * x53;
    const double x56 = -(1e-09 * (1.0 + (x44 + x20 * x20) / x40) + x18 * x54 + x53 * x55);
    const double x57 = 1.0 / x56;
    const double x58 = x29 + x34;
    const double x59 = x38 - x47 * x58;
    const double x60 = x35 - x50 * x58 - x51 * x59;
    const double x61 = x57 * (x30 + x54 * x59 - x55 * x60);
    const double x62 = x52 * x60 - x55 * x61;
    const double x63 = x48 * x59 - x51 * x62 + x54 * x61;
    const double x64 = x46 * x58 - x47 * x63 - x50 * x62;
    const double x65 = x45 * x63;
    const double x66 = -999999999.9999999 * x65;
    const double x67 = -(x34 + x64);
    const double x68 = x38 - (x42 * x63 + x43 * x62) + (x66 + (x18 * x61 - x19 * x64));
    const double x69 = -(x64 + (x34 + x67));
    const double x70 = x29 - (x67 + (x19 * x63 + x21 * x62)) - x69;
    const double x71 = x66 + x68 - x47 * x70;
    const double x72 = x35 - (x43 * x63 + x40 * x62) + (x20 * x61 - x21 * x64) - x50 * x70;
    const double x73 = x72 - x51 * x71;
    const double x74 = x57 * (x30 + (x18 * x63 + x20 * x62) + x54 * x71 - x55 * x73);
    const double x75 = x52 * x73 - x55 * x74;
    const double x76 = x48 * x71 - x51 * x75 + x54 * x74;
    const double x77 = x46 * x70 - x47 * x76 - x50 * x75;
    const double x78 = x63 + x76;
    const double x79 = x62 + x75;
    const double x80 = x67 + (x69 - x77);
    const double x81 = -(x64 + x77);
    const double x82 = -(x61 + x74);
    const double x83 = x66 - (999999999.9999999 * x65 + 999999999.9999999 * (x45 * x76));
    const double x84 = x38 - (x42 * x78 + x43 * x79) + (x83 + (x19 * x81 - x18 * x82));
    const double x85 = x81 - (x34 + x80);
    const double x86 = x29 - (x80 + (x19 * x78 + x21 * x79)) - x85;
    const double x87 = x45 * x78;
    const double x88 = x84 - 999999999.9999999 * x87 - x47 * x86;
    const double x89 = x35 - (x43 * x78 + x40 * x79) + (x21 * x81 - x20 * x82) - x50 * x86;
    const double x90 = x89 - x51 * x88;
    const double x91 = x57 * (x30 + (x18 * x78 + x20 * x79) + x54 * x88 - x55 * x90);
    const double x92 = x52 * x90 - x55 * x91;
    const double x93 = x48 * x88 - x51 * x92 + x54 * x91;
    const double x94 = x46 * x86 - x47 * x93 - x50 * x92;
    const double x95 = x83 - (999999999.9999999 * x87 + 999999999.9999999 * (x45 * x93));
    (void)t;
    qdot[0] = v[0];
    qdot[1] = v[1];
    qdot[2] = v[2];
    vdot[0] = x78 + x93;
    vdot[1] = x79 + x92;
    vdot[2] = x80 + (x85 - x94);
    lam[0] = x81 - x94;
    lam[1] = x82 - x91;
    lam[2] = x95;
}

void slider_crank_energies(double t, const double *q, const double *v, const double *p, double *kinetic,
    double *potential)
{
    const double x1 = p[1] - (p[1] + 0.5 * p[2]);
    const double x2 = cos(q[0]);
    const double x3 = sin(q[0]);
    const double x4 = p[1] * x2;
    const double x5 = p[1] * x3;
    const double x6 = cos(q[1]);
    const double x7 = sin(q[1]);
    const double x8 = x5 - x1 * (x3 * x6 + x2 * x7);
    const double x9 = v[0] * x5;
    const double x10 = v[0] * x4;
    const double x11 = v[0] + v[1];
    const double x12 = -(x9 + x11 * (x8 - x5));
    const double x13 = x10 + x11 * (x4 - x1 * (x2 * x6 - x3 * x7) - x4);
    const double x14 = p[1] + p[2] + q[2] - 1.2;
    const double x15 = 0.5 * (0.25 * (x9 * x9) + 0.25 * (x10 * x10)) + 0.041666666666666664 * (v[0] * (p[1] * p[1] * v[0]));
    const double x16 = 0.75 * (x12 * x12 + x13 * x13) + 0.0625 * (x11 * (p[2] * p[2] * x11));
    const double x17 = sqrt(x14 * x14) - 0.5;
    (void)t;
    kinetic[0] = 0.5 * (v[2] * v[2]) + (x15 + x16);
    potential[0] = 4.905 * x5 + 14.715 * x8 + 100.0 * (x17 * x17);
}
