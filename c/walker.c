/* Functions of the mechanism 'walker', written by flyball 0.4.0.

       qdot = T v,  M vdot = f + G^T lam,  g = 0,  G v = nu,  G vdot = gamma

   SI units and radians. World axes unless stated otherwise. Velocities v are rates of the coordinates q,
   but for bodies that turn freely: unit quaternions e0 to e3 (scalar first) in q, angular velocities w_x,
   w_y, w_z along the body's own axes in v. Reactions are G^T lam.
   Arguments and results are arrays of double, matrices row by row; results must be allocated by the caller.
   The functions have no static data, so threads may share them. Compile with a C99 compiler, link with -lm.

   Coordinates: joint: these make the fewest equations.
   q (3): root.angle, left.hip.angle, right.hip.angle
   v (3): root.angle', left.hip.angle', right.hip.angle'
   p (5): left.l, left.k, left.load, right.l, right.load
   kinematics: 30 operations
   velocities: 52 operations
   T: 0 operations
   M: 132 operations
   f: 264 operations
   g: 0 operations
   nu: 0 operations
   G: 0 operations
   gamma: 0 operations
   residual: 376 operations
   right_hand_side: 410 operations
   energies: 122 operations */
#include "walker.h"

#include <math.h>

const char *const walker_q_names[3] = {
    "root.angle", "left.hip.angle", "right.hip.angle",
};

const char *const walker_v_names[3] = {
    "root.angle'", "left.hip.angle'", "right.hip.angle'",
};

const char *const walker_p_names[5] = {
    "left.l", "left.k", "left.load", "right.l", "right.load",
};

const double walker_q_start[3] = {
    0.0, 0.0, 0.0,
};

const double walker_v_start[3] = {
    0.0, 0.0, 0.0,
};

const double walker_p_values[5] = {
    0.4, 2.0, 0.0, 0.4, 0.0,
};

void walker_kinematics(double t, const double *q, const double *p, double *positions, double *rotations)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x5;
    const double x8 = x3 * x5;
    const double x9 = cos(q[2]);
    const double x10 = sin(q[2]);
    const double x11 = x4 * x9;
    const double x12 = x3 * x9;
    (void)t;
    positions[0] = 0.0;
    positions[1] = 0.0;
    positions[2] = 0.5;
    positions[3] = -x1 * x7;
    positions[4] = 0.30000000000000004 + x1 * x6;
    positions[5] = 0.5 - x1 * x8;
    positions[6] = -x2 * x11;
    positions[7] = -(0.30000000000000004 + x2 * x10);
    positions[8] = 0.5 - x2 * x12;
    rotations[0] = x3;
    rotations[1] = 0.0;
    rotations[2] = x4;
    rotations[3] = 0.0;
    rotations[4] = 1.0;
    rotations[5] = 0.0;
    rotations[6] = -x4;
    rotations[7] = 0.0;
    rotations[8] = x3;
    rotations[9] = x3;
    rotations[10] = x4 * x6;
    rotations[11] = x7;
    rotations[12] = 0.0;
    rotations[13] = x5;
    rotations[14] = -x6;
    rotations[15] = -x4;
    rotations[16] = x3 * x6;
    rotations[17] = x8;
    rotations[18] = x3;
    rotations[19] = -x4 * x10;
    rotations[20] = x11;
    rotations[21] = 0.0;
    rotations[22] = x9;
    rotations[23] = x10;
    rotations[24] = -x4;
    rotations[25] = -x3 * x10;
    rotations[26] = x12;
}

void walker_velocities(double t, const double *q, const double *v, const double *p, double *velocities, double
    *angular_velocities)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = x1 * (x4 * x5);
    const double x7 = cos(q[2]);
    const double x8 = x2 * (x4 * x7);
    const double x9 = v[1] * x3;
    const double x10 = v[1] * x4;
    const double x11 = 0.30000000000000004 + x1 * sin(q[1]) - 0.30000000000000004;
    const double x12 = 0.5 - x1 * (x3 * x5) - 0.5;
    const double x13 = v[2] * x3;
    const double x14 = v[2] * x4;
    const double x15 = 0.30000000000000004 - (0.30000000000000004 + x2 * sin(q[2]));
    const double x16 = 0.5 - x2 * (x3 * x7) - 0.5;
    (void)t;
    velocities[0] = 0.0;
    velocities[1] = 0.0;
    velocities[2] = 0.0;
    velocities[3] = v[0] * x12 + x10 * x11;
    velocities[4] = x6 * x10 - x9 * x12;
    velocities[5] = x9 * x11 + v[0] * x6;
    velocities[6] = v[0] * x16 - x14 * x15;
    velocities[7] = x13 * x16 - x8 * x14;
    velocities[8] = v[0] * x8 - x13 * x15;
    angular_velocities[0] = 0.0;
    angular_velocities[1] = v[0];
    angular_velocities[2] = 0.0;
    angular_velocities[3] = x9;
    angular_velocities[4] = v[0];
    angular_velocities[5] = -x10;
    angular_velocities[6] = -x13;
    angular_velocities[7] = v[0];
    angular_velocities[8] = x14;
}

void walker_T(const double *q, const double *p, double *T)
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

void walker_M(const double *q, const double *p, double *M)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x6;
    const double x8 = x3 * x6;
    const double x9 = x1 * (x4 * x5);
    const double x10 = cos(q[2]);
    const double x11 = sin(q[2]);
    const double x12 = x4 * x11;
    const double x13 = x3 * x11;
    const double x14 = x2 * (x4 * x10);
    const double x15 = 0.30000000000000004 + x1 * x6 - 0.30000000000000004;
    const double x16 = 0.5 - x1 * (x3 * x5) - 0.5;
    const double x17 = 0.30000000000000004 - (0.30000000000000004 + x2 * x11);
    const double x18 = 0.5 - x2 * (x3 * x10) - 0.5;
    const double x19 = 0.008 * (x3 * x3);
    const double x20 = -0.008 * (x3 * x4);
    const double x21 = 0.008 * (x4 * x4);
    const double x22 = x9 * x9;
    const double x23 = x15 * x15;
    const double x24 = x16 * x16;
    const double x25 = x20 + 0.008 * (x7 * x8) + x9 * x16;
    const double x26 = x14 * x14;
    const double x27 = x17 * x17;
    const double x28 = x18 * x18;
    const double x29 = x20 + 0.008 * (x12 * x13) + x14 * x18;
    const double x30 = 0.002 + 0.008 * (x5 * x5) + (x22 + x24) + (0.1 + (0.002 + 0.008 * (x10 * x10) + (x26 + x28)));
    const double x31 = x3 * (0.002 + (x19 + 0.008 * (x7 * x7)) + (x23 + x24)) - x4 * x25;
    const double x32 = x3 * (0.008 * (x5 * x7) + x9 * x15) - x4 * (0.008 * (x5 * x8) - x15 * x16);
    const double x33 = x3 * x25 - x4 * (0.002 + (x21 + 0.008 * (x8 * x8)) + (x22 + x23));
    const double x34 = x4 * x29 - x3 * (0.002 + (x19 + 0.008 * (x12 * x12)) + (x27 + x28));
    const double x35 = -(x3 * (x14 * x17 - 0.008 * (x10 * x12)) + x4 * (0.008 * (x10 * x13) + x17 * x18));
    const double x36 = x4 * (0.002 + (x21 + 0.008 * (x13 * x13)) + (x26 + x27)) - x3 * x29;
    M[0] = x30;
    M[1] = x32;
    M[2] = x35;
    M[3] = x32;
    M[4] = x3 * x31 - x4 * x33;
    M[5] = 0.0;
    M[6] = x35;
    M[7] = 0.0;
    M[8] = x4 * x36 - x3 * x34;
}

void walker_f(double t, const double *q, const double *v, const double *p, double *f)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x5;
    const double x8 = x4 * x6;
    const double x9 = x3 * x5;
    const double x10 = x3 * x6;
    const double x11 = x1 * x7;
    const double x12 = cos(q[2]);
    const double x13 = sin(q[2]);
    const double x14 = x4 * x12;
    const double x15 = x4 * x13;
    const double x16 = x3 * x12;
    const double x17 = x3 * x13;
    const double x18 = x2 * x14;
    const double x19 = x4 * x7 + x3 * x9;
    const double x20 = 1.0 / (x19 * x19 + x6 * x6);
    const double x21 = x3 * ((x6 * x10 + x9 * x19) * x20) + x4 * ((x7 * x19 + x6 * x8) * x20);
    const double x22 = x4 * x14 + x3 * x16;
    const double x23 = 1.0 / (x22 * x22 + x13 * x13);
    const double x24 = x3 * ((x13 * x17 + x16 * x22) * x23) + x4 * ((x14 * x22 + x13 * x15) * x23);
    const double x25 = v[1] * x3;
    const double x26 = v[1] * x4;
    const double x27 = v[0] * x26;
    const double x28 = v[0] * x25;
    const double x29 = 0.30000000000000004 + x1 * x6 - 0.30000000000000004;
    const double x30 = 0.5 - x1 * x9 - 0.5;
    const double x31 = v[0] * x30 + x26 * x29;
    const double x32 = x11 * x26 - x25 * x30;
    const double x33 = x25 * x29 + v[0] * x11;
    const double x34 = x28 * x29 + (v[0] * x33 + x26 * x32);
    const double x35 = x11 * x28 + x27 * x30 - (x26 * x31 + x25 * x33);
    const double x36 = v[2] * x3;
    const double x37 = v[2] * x4;
    const double x38 = v[0] * x37;
    const double x39 = v[0] * x36;
    const double x40 = 0.30000000000000004 - (0.30000000000000004 + x2 * x13);
    const double x41 = 0.5 - x2 * x16 - 0.5;
    const double x42 = v[0] * x41 - x37 * x40;
    const double x43 = x36 * x41 - x18 * x37;
    const double x44 = v[0] * x18 - x36 * x40;
    const double x45 = v[0] * x44 - x37 * x43 - x39 * x40;
    const double x46 = x37 * x42 + x36 * x44 - (x18 * x39 + x38 * x41);
    const double x47 = -(9.81 + (x25 * x32 - v[0] * x31 - x27 * x29));
    const double x48 = x7 * x25 - v[0] * x6 - x9 * x26;
    const double x49 = -(x7 * x27 + x9 * x28);
    const double x50 = 0.01 * (x4 * x28 - x3 * x27) - 0.008 * ((x8 * x25 + v[0] * x5 - x10 * x26) * x48);
    const double x51 = 0.008 * ((x3 * x25 + x4 * x26) * x48) - 0.01 * (x8 * x27 + x10 * x28);
    const double x52 = -(9.81 + (x38 * x40 - (x36 * x43 + v[0] * x42)));
    const double x53 = v[0] * x13 - x14 * x36 + x16 * x37;
    const double x54 = x14 * x38 + x16 * x39;
    const double x55 = 0.01 * (x3 * x38 - x4 * x39) - 0.008 * ((x15 * x36 + v[0] * x12 - x17 * x37) * x53);
    const double x56 = -(0.01 * (x15 * x38 + x17 * x39) + 0.008 * ((x3 * x36 + x4 * x37) * x53));
    const double x57 = x40 * x52 + x41 * x46 - (x3 * x55 - x15 * x56 + 0.002 * (x14 * x54));
    const double x58 = x18 * x46 + x40 * x45 - (0.002 * (x16 * x54) - (x4 * x55 + x17 * x56));
    const double x59 = x29 * x47 + x30 * x35 - (x3 * x50 + x8 * x51 + 0.002 * (x7 * x49));
    const double x60 = x11 * x35 + x29 * x34 - (x10 * x51 - x4 * x50 + 0.002 * (x9 * x49));
    const double x61 = x18 * x52 - x41 * x45 - (x12 * x56 + 0.002 * (x13 * x54)) + (x11 * x47 - x30 * x34 - (x5 * x51 - 0.002 * (x6 * x49)));
    (void)t;
    f[0] = x61;
    f[1] = x3 * x59 - x4 * x60 + x21 * (p[2] - p[1] * q[1]);
    f[2] = x4 * x58 - x3 * x57 + x24 * (p[4] - 2.0 * (p[1] * q[2]));
}

void walker_g(double t, const double *q, const double *p, double *g)
{
    (void)t;
    (void)q;
    (void)p;
    (void)g;
}

void walker_nu(double t, const double *q, const double *p, double *nu)
{
    (void)t;
    (void)q;
    (void)p;
    (void)nu;
}

void walker_G(double t, const double *q, const double *p, double *G)
{
    (void)t;
    (void)q;
    (void)p;
    (void)G;
}

void walker_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2)
{
    (void)t;
    (void)q;
    (void)v;
    (void)p;
    (void)gamma_2;
}

void walker_residual(double t, const double *q, const double *v, const double *vdot, const double *p, double
    *residual)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x5;
    const double x8 = x4 * x6;
    const double x9 = x3 * x5;
    const double x10 = x3 * x6;
    const double x11 = x1 * x7;
    const double x12 = cos(q[2]);
    const double x13 = sin(q[2]);
    const double x14 = x4 * x12;
    const double x15 = x4 * x13;
    const double x16 = x3 * x12;
    const double x17 = x3 * x13;
    const double x18 = x2 * x14;
    const double x19 = x4 * x7 + x3 * x9;
    const double x20 = 1.0 / (x19 * x19 + x6 * x6);
    const double x21 = x3 * ((x6 * x10 + x9 * x19) * x20) + x4 * ((x7 * x19 + x6 * x8) * x20);
    const double x22 = x4 * x14 + x3 * x16;
    const double x23 = 1.0 / (x22 * x22 + x13 * x13);
    const double x24 = x3 * ((x13 * x17 + x16 * x22) * x23) + x4 * ((x14 * x22 + x13 * x15) * x23);
    const double x25 = v[1] * x3;
    const double x26 = v[1] * x4;
    const double x27 = v[0] * x26;
    const double x28 = v[0] * x25;
    const double x29 = 0.30000000000000004 + x1 * x6 - 0.30000000000000004;
    const double x30 = 0.5 - x1 * x9 - 0.5;
    const double x31 = v[0] * x30 + x26 * x29;
    const double x32 = x11 * x26 - x25 * x30;
    const double x33 = x25 * x29 + v[0] * x11;
    const double x34 = x28 * x29 + (v[0] * x33 + x26 * x32);
    const double x35 = x11 * x28 + x27 * x30 - (x26 * x31 + x25 * x33);
    const double x36 = v[2] * x3;
    const double x37 = v[2] * x4;
    const double x38 = v[0] * x37;
    const double x39 = v[0] * x36;
    const double x40 = 0.30000000000000004 - (0.30000000000000004 + x2 * x13);
    const double x41 = 0.5 - x2 * x16 - 0.5;
    const double x42 = v[0] * x41 - x37 * x40;
    const double x43 = x36 * x41 - x18 * x37;
    const double x44 = v[0] * x18 - x36 * x40;
    const double x45 = v[0] * x44 - x37 * x43 - x39 * x40;
    const double x46 = x37 * x42 + x36 * x44 - (x18 * x39 + x38 * x41);
    const double x47 = -(9.81 + (x25 * x32 - v[0] * x31 - x27 * x29));
    const double x48 = x7 * x25 - v[0] * x6 - x9 * x26;
    const double x49 = -(x7 * x27 + x9 * x28);
    const double x50 = 0.01 * (x4 * x28 - x3 * x27) - 0.008 * ((x8 * x25 + v[0] * x5 - x10 * x26) * x48);
    const double x51 = 0.008 * ((x3 * x25 + x4 * x26) * x48) - 0.01 * (x8 * x27 + x10 * x28);
    const double x52 = -(9.81 + (x38 * x40 - (x36 * x43 + v[0] * x42)));
    const double x53 = v[0] * x13 - x14 * x36 + x16 * x37;
    const double x54 = x14 * x38 + x16 * x39;
    const double x55 = 0.01 * (x3 * x38 - x4 * x39) - 0.008 * ((x15 * x36 + v[0] * x12 - x17 * x37) * x53);
    const double x56 = -(0.01 * (x15 * x38 + x17 * x39) + 0.008 * ((x3 * x36 + x4 * x37) * x53));
    const double x57 = x40 * x52 + x41 * x46 - (x3 * x55 - x15 * x56 + 0.002 * (x14 * x54));
    const double x58 = x18 * x46 + x40 * x45 - (0.002 * (x16 * x54) - (x4 * x55 + x17 * x56));
    const double x59 = x29 * x47 + x30 * x35 - (x3 * x50 + x8 * x51 + 0.002 * (x7 * x49));
    const double x60 = x11 * x35 + x29 * x34 - (x10 * x51 - x4 * x50 + 0.002 * (x9 * x49));
    const double x61 = x18 * x52 - x41 * x45 - (x12 * x56 + 0.002 * (x13 * x54)) + (x11 * x47 - x30 * x34 - (x5 * x51 - 0.002 * (x6 * x49)));
    const double x62 = 0.008 * (x3 * x3);
    const double x63 = -0.008 * (x3 * x4);
    const double x64 = 0.008 * (x4 * x4);
    const double x65 = x11 * x11;
    const double x66 = x29 * x29;
    const double x67 = x30 * x30;
    const double x68 = x63 + 0.008 * (x8 * x10) + x11 * x30;
    const double x69 = x18 * x18;
    const double x70 = x40 * x40;
    const double x71 = x41 * x41;
    const double x72 = x63 + 0.008 * (x15 * x17) + x18 * x41;
    const double x73 = 0.002 + 0.008 * (x5 * x5) + (x65 + x67) + (0.1 + (0.002 + 0.008 * (x12 * x12) + (x69 + x71)));
    const double x74 = x3 * (0.002 + (x62 + 0.008 * (x8 * x8)) + (x66 + x67)) - x4 * x68;
    const double x75 = x3 * (0.008 * (x5 * x8) + x11 * x29) - x4 * (0.008 * (x5 * x10) - x29 * x30);
    const double x76 = x3 * x68 - x4 * (0.002 + (x64 + 0.008 * (x10 * x10)) + (x65 + x66));
    const double x77 = x4 * x72 - x3 * (0.002 + (x62 + 0.008 * (x15 * x15)) + (x70 + x71));
    const double x78 = -(x3 * (x18 * x40 - 0.008 * (x12 * x15)) + x4 * (0.008 * (x12 * x17) + x40 * x41));
    const double x79 = x4 * (0.002 + (x64 + 0.008 * (x17 * x17)) + (x69 + x70)) - x3 * x72;
    const double x80 = x75 * vdot[0] + (x3 * x74 - x4 * x76) * vdot[1] - (x3 * x59 - x4 * x60 + x21 * (p[2] - p[1] * q[1]));
    const double x81 = x78 * vdot[0] + (x4 * x79 - x3 * x77) * vdot[2] - (x4 * x58 - x3 * x57 + x24 * (p[4] - 2.0 * (p[1] * q[2])));
    (void)t;
    residual[0] = x73 * vdot[0] + x75 * vdot[1] + x78 * vdot[2] - x61;
    residual[1] = x80;
    residual[2] = x81;
}

void walker_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot, double
    *vdot, double *lam)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x5;
    const double x8 = x4 * x6;
    const double x9 = x3 * x5;
    const double x10 = x3 * x6;
    const double x11 = x1 * x7;
    const double x12 = cos(q[2]);
    const double x13 = sin(q[2]);
    const double x14 = x4 * x12;
    const double x15 = x4 * x13;
    const double x16 = x3 * x12;
    const double x17 = x3 * x13;
    const double x18 = x2 * x14;
    const double x19 = x4 * x7 + x3 * x9;
    const double x20 = 1.0 / (x19 * x19 + x6 * x6);
    const double x21 = x3 * ((x6 * x10 + x9 * x19) * x20) + x4 * ((x7 * x19 + x6 * x8) * x20);
    const double x22 = x4 * x14 + x3 * x16;
    const double x23 = 1.0 / (x22 * x22 + x13 * x13);
    const double x24 = x3 * ((x13 * x17 + x16 * x22) * x23) + x4 * ((x14 * x22 + x13 * x15) * x23);
    const double x25 = v[1] * x3;
    const double x26 = v[1] * x4;
    const double x27 = v[0] * x26;
    const double x28 = v[0] * x25;
    const double x29 = 0.30000000000000004 + x1 * x6 - 0.30000000000000004;
    const double x30 = 0.5 - x1 * x9 - 0.5;
    const double x31 = v[0] * x30 + x26 * x29;
    const double x32 = x11 * x26 - x25 * x30;
    const double x33 = x25 * x29 + v[0] * x11;
    const double x34 = x28 * x29 + (v[0] * x33 + x26 * x32);
    const double x35 = x11 * x28 + x27 * x30 - (x26 * x31 + x25 * x33);
    const double x36 = v[2] * x3;
    const double x37 = v[2] * x4;
    const double x38 = v[0] * x37;
    const double x39 = v[0] * x36;
    const double x40 = 0.30000000000000004 - (0.30000000000000004 + x2 * x13);
    const double x41 = 0.5 - x2 * x16 - 0.5;
    const double x42 = v[0] * x41 - x37 * x40;
    const double x43 = x36 * x41 - x18 * x37;
    const double x44 = v[0] * x18 - x36 * x40;
    const double x45 = v[0] * x44 - x37 * x43 - x39 * x40;
    const double x46 = x37 * x42 + x36 * x44 - (x18 * x39 + x38 * x41);
    const double x47 = -(9.81 + (x25 * x32 - v[0] * x31 - x27 * x29));
    const double x48 = x7 * x25 - v[0] * x6 - x9 * x26;
    const double x49 = -(x7 * x27 + x9 * x28);
    const double x50 = 0.01 * (x4 * x28 - x3 * x27) - 0.008 * ((x8 * x25 + v[0] * x5 - x10 * x26) * x48);
    const double x51 = 0.008 * ((x3 * x25 + x4 * x26) * x48) - 0.01 * (x8 * x27 + x10 * x28);
    const double x52 = -(9.81 + (x38 * x40 - (x36 * x43 + v[0] * x42)));
    const double x53 = v[0] * x13 - x14 * x36 + x16 * x37;
    const double x54 = x14 * x38 + x16 * x39;
    const double x55 = 0.01 * (x3 * x38 - x4 * x39) - 0.008 * ((x15 * x36 + v[0] * x12 - x17 * x37) * x53);
    const double x56 = -(0.01 * (x15 * x38 + x17 * x39) + 0.008 * ((x3 * x36 + x4 * x37) * x53));
    const double x57 = x40 * x52 + x41 * x46 - (x3 * x55 - x15 * x56 + 0.002 * (x14 * x54));
    const double x58 = x18 * x46 + x40 * x45 - (0.002 * (x16 * x54) - (x4 * x55 + x17 * x56));
    const double x59 = x29 * x47 + x30 * x35 - (x3 * x50 + x8 * x51 + 0.002 * (x7 * x49));
    const double x60 = x11 * x35 + x29 * x34 - (x10 * x51 - x4 * x50 + 0.002 * (x9 * x49));
    const double x61 = x18 * x52 - x41 * x45 - (x12 * x56 + 0.002 * (x13 * x54)) + (x11 * x47 - x30 * x34 - (x5 * x51 - 0.002 * (x6 * x49)));
    const double x62 = 0.008 * (x3 * x3);
    const double x63 = -0.008 * (x3 * x4);
    const double x64 = 0.008 * (x4 * x4);
    const double x65 = x11 * x11;
    const double x66 = x29 * x29;
    const double x67 = x30 * x30;
    const double x68 = x63 + 0.008 * (x8 * x10) + x11 * x30;
    const double x69 = x18 * x18;
    const double x70 = x40 * x40;
    const double x71 = x41 * x41;
    const double x72 = x63 + 0.008 * (x15 * x17) + x18 * x41;
    const double x73 = 0.002 + 0.008 * (x5 * x5) + (x65 + x67) + (0.1 + (0.002 + 0.008 * (x12 * x12) + (x69 + x71)));
    const double x74 = x3 * (0.002 + (x62 + 0.008 * (x8 * x8)) + (x66 + x67)) - x4 * x68;
    const double x75 = x3 * (0.008 * (x5 * x8) + x11 * x29) - x4 * (0.008 * (x5 * x10) - x29 * x30);
    const double x76 = x3 * x68 - x4 * (0.002 + (x64 + 0.008 * (x10 * x10)) + (x65 + x66));
    const double x77 = x3 * x74 - x4 * x76;
    const double x78 = x4 * x72 - x3 * (0.002 + (x62 + 0.008 * (x15 * x15)) + (x70 + x71));
    const double x79 = -(x3 * (x18 * x40 - 0.008 * (x12 * x15)) + x4 * (0.008 * (x12 * x17) + x40 * x41));
    const double x80 = x4 * (0.002 + (x64 + 0.008 * (x17 * x17)) + (x69 + x70)) - x3 * x72;
    const double x81 = x4 * x80 - x3 * x78;
    const double x82 = x3 * x59 - x4 * x60 + x21 * (p[2] - p[1] * q[1]);
    const double x83 = x4 * x58 - x3 * x57 + x24 * (p[4] - 2.0 * (p[1] * q[2]));
    const double x84 = 1.0 / x77;
    const double x85 = x75 * x84;
    const double x86 = 1.0 / (x73 - x75 * x85);
    const double x87 = x79 * x86;
    const double x88 = 1.0 / (x81 - x79 * x87);
    const double x89 = x61 - x82 * x85;
    const double x90 = x88 * (x83 - x87 * x89);
    const double x91 = x86 * x89 - x87 * x90;
    const double x92 = x82 * x84 - x85 * x91;
    const double x93 = x82 - (x75 * x91 + x77 * x92);
    const double x94 = x61 - (x73 * x91 + x75 * x92 + x79 * x90) - x85 * x93;
    const double x95 = x88 * (x83 - (x79 * x91 + x81 * x90) - x87 * x94);
    const double x96 = x86 * x94 - x87 * x95;
    (void)t;
    qdot[0] = v[0];
    qdot[1] = v[1];
    qdot[2] = v[2];
    vdot[0] = x91 + x96;
    vdot[1] = x92 + (x84 * x93 - x85 * x96);
    vdot[2] = x90 + x95;
    (void)lam;
}

void walker_energies(double t, const double *q, const double *v, const double *p, double *kinetic, double
    *potential)
{
    const double x1 = 0.5 - (0.5 - 0.5 * p[0]);
    const double x2 = 0.5 - (0.5 - 0.5 * p[3]);
    const double x3 = cos(q[0]);
    const double x4 = sin(q[0]);
    const double x5 = cos(q[1]);
    const double x6 = sin(q[1]);
    const double x7 = x4 * x5;
    const double x8 = x3 * x5;
    const double x9 = x1 * x7;
    const double x10 = 0.5 - x1 * x8;
    const double x11 = cos(q[2]);
    const double x12 = sin(q[2]);
    const double x13 = x4 * x11;
    const double x14 = x3 * x11;
    const double x15 = x2 * x13;
    const double x16 = 0.5 - x2 * x14;
    const double x17 = v[1] * x3;
    const double x18 = v[1] * x4;
    const double x19 = 0.30000000000000004 + x1 * x6 - 0.30000000000000004;
    const double x20 = x10 - 0.5;
    const double x21 = v[0] * x20 + x18 * x19;
    const double x22 = x9 * x18 - x17 * x20;
    const double x23 = x17 * x19 + v[0] * x9;
    const double x24 = v[2] * x3;
    const double x25 = v[2] * x4;
    const double x26 = 0.30000000000000004 - (0.30000000000000004 + x2 * x12);
    const double x27 = x16 - 0.5;
    const double x28 = v[0] * x27 - x25 * x26;
    const double x29 = x24 * x27 - x15 * x25;
    const double x30 = v[0] * x15 - x24 * x26;
    const double x31 = x3 * x17 + x4 * x18;
    const double x32 = x4 * x6 * x17 + v[0] * x5 - x3 * x6 * x18;
    const double x33 = x7 * x17 - v[0] * x6 - x8 * x18;
    const double x34 = -(x3 * x24 + x4 * x25);
    const double x35 = x4 * x12 * x24 + v[0] * x11 - x3 * x12 * x25;
    const double x36 = v[0] * x12 - x13 * x24 + x14 * x25;
    const double x37 = 0.01 * (x31 * x31) + 0.01 * (x32 * x32) + 0.002 * (x33 * x33);
    const double x38 = 0.01 * (x34 * x34) + 0.01 * (x35 * x35) + 0.002 * (x36 * x36);
    const double x39 = 0.05 * (v[0] * v[0]) + (0.5 * (x21 * x21 + x22 * x22 + x23 * x23) + 0.5 * x37);
    (void)t;
    kinetic[0] = 0.5 * (x28 * x28 + x29 * x29 + x30 * x30) + 0.5 * x38 + x39;
    potential[0] = 9.81 * x16 + (9.81 * x10 + 24.525000000000002);
}
