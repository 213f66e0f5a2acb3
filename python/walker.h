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
#ifndef WALKER_H
#define WALKER_H

#ifdef __cplusplus
extern "C" {
#endif

extern const char *const walker_q_names[3];
extern const char *const walker_v_names[3];
extern const char *const walker_p_names[5];
extern const double walker_q_start[3];
extern const double walker_v_start[3];
extern const double walker_p_values[5];

/* Poses of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     positions[3][3]: of trunk, left.thigh, right.thigh: origins [m], along the world's axes, row by row
     rotations[3][3][3]: their axes, as columns, row by row
   30 operations. Results must not overlap arguments. */
void walker_kinematics(double t, const double *q, const double *p, double *positions, double *rotations);

/* Velocities of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     velocities[3][3]: of trunk, left.thigh, right.thigh: of origins [m/s], along the world's axes, row by
         row
     angular_velocities[3][3]: [rad/s], along the world's axes, row by row
   52 operations. Results must not overlap arguments. */
void walker_velocities(double t, const double *q, const double *v, const double *p, double *velocities, double
    *angular_velocities);

/* qdot = T v.
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     T[3][3]: rates of the coordinates by the velocities, row by row
   0 operations. Results must not overlap arguments. */
void walker_T(const double *q, const double *p, double *T);

/* Mass matrix.
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     M[3][3]: symmetric [kg, kg m, kg m^2], row by row
   132 operations. Results must not overlap arguments. */
void walker_M(const double *q, const double *p, double *M);

/* All forces but reactions along the velocities, gyroscopic ones included.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     f[3]: [N, N m]
   264 operations. Results must not overlap arguments. */
void walker_f(double t, const double *q, const double *v, const double *p, double *f);

/* Constraints, g = 0.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     g[0]: [m, rad, 1]; 0 for those of velocities only
   0 operations. Results must not overlap arguments. */
void walker_g(double t, const double *q, const double *p, double *g);

/* Velocity constraints: G v = nu.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     nu[0]
   0 operations. Results must not overlap arguments. */
void walker_nu(double t, const double *q, const double *p, double *nu);

/* Jacobian of the constraints along the velocities.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     G[0][3]: , row by row
   0 operations. Results must not overlap arguments. */
void walker_G(double t, const double *q, const double *p, double *G);

/* Acceleration constraints: G vdot = gamma.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     gamma_2[0]
   0 operations. Results must not overlap arguments. */
void walker_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2);

/* M vdot - f - G^T lam: zero along every motion.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     vdot[3]: accelerations: root.angle'' [rad/s^2], left.hip.angle'' [rad/s^2], right.hip.angle'' [rad/s^2]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     residual[3]: [N, N m]
   376 operations. Results must not overlap arguments. */
void walker_residual(double t, const double *q, const double *v, const double *vdot, const double *p, double
    *residual);

/* Accelerations and multipliers at a state with g = 0 and G v = nu.
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     qdot[3]: rates of the coordinates
     vdot[3]: accelerations
     lam[0]: multipliers: reactions are G^T lam
   410 operations. Results must not overlap arguments. */
void walker_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot, double
    *vdot, double *lam);

/* Kinetic energy, and potential energy of gravity and springs [J].
     t: time: t [s]
     q[3]: coordinates: root.angle [rad], left.hip.angle [rad], right.hip.angle [rad]
     v[3]: velocities: root.angle' [rad/s], left.hip.angle' [rad/s], right.hip.angle' [rad/s]
     p[5]: parameters: left.l, left.k, left.load, right.l, right.load
     kinetic[1]
     potential[1]
   122 operations. Results must not overlap arguments. */
void walker_energies(double t, const double *q, const double *v, const double *p, double *kinetic, double
    *potential);

#ifdef __cplusplus
}
#endif

#endif
