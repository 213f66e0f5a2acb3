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
#ifndef P_H
#define P_H

#ifdef __cplusplus
extern "C" {
#endif

extern const char *const p_q_names[1];
extern const char *const p_v_names[1];
extern const char *const p_p_names[2];
extern const double p_q_start[1];
extern const double p_v_start[1];
extern const double p_p_values[2];

/* Poses of bodies' reference frames and of named frames.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     positions[1][3]: of a: origins [m], along the world's axes, row by row
     rotations[1][3][3]: their axes, as columns, row by row
   4 operations. Results must not overlap arguments. */
void p_kinematics(double t, const double *q, const double *p, double *positions, double *rotations);

/* Velocities of bodies' reference frames and of named frames.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     p[2]: parameters: k, l
     velocities[1][3]: of a: of origins [m/s], along the world's axes, row by row
     angular_velocities[1][3]: [rad/s], along the world's axes, row by row
   6 operations. Results must not overlap arguments. */
void p_velocities(double t, const double *q, const double *v, const double *p, double *velocities, double
    *angular_velocities);

/* qdot = T v.
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     T[1][1]: rates of the coordinates by the velocities, row by row
   0 operations. Results must not overlap arguments. */
void p_T(const double *q, const double *p, double *T);

/* Mass matrix.
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     M[1][1]: symmetric [kg, kg m, kg m^2], row by row
   8 operations. Results must not overlap arguments. */
void p_M(const double *q, const double *p, double *M);

/* All forces but reactions along the velocities, gyroscopic ones included.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     p[2]: parameters: k, l
     f[1]: [N, N m]
   16 operations. Results must not overlap arguments. */
void p_f(double t, const double *q, const double *v, const double *p, double *f);

/* Constraints, g = 0.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     g[0]: [m, rad, 1]; 0 for those of velocities only
   0 operations. Results must not overlap arguments. */
void p_g(double t, const double *q, const double *p, double *g);

/* What constraints ask of velocities: G v = nu.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     nu[0]
   0 operations. Results must not overlap arguments. */
void p_nu(double t, const double *q, const double *p, double *nu);

/* Jacobian of the constraints along the velocities.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     p[2]: parameters: k, l
     G[0][1]: , row by row
   0 operations. Results must not overlap arguments. */
void p_G(double t, const double *q, const double *p, double *G);

/* What constraints ask of accelerations: G vdot = gamma.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     p[2]: parameters: k, l
     gamma_2[0]
   0 operations. Results must not overlap arguments. */
void p_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2);

/* M vdot - f - G^T lam: zero along every motion.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     vdot[1]: accelerations: A.angle'' [rad/s^2]
     p[2]: parameters: k, l
     residual[1]: [N, N m]
   22 operations. Results must not overlap arguments. */
void p_residual(double t, const double *q, const double *v, const double *vdot, const double *p, double
    *residual);

/* Accelerations and multipliers at a state with g = 0 and G v = nu.
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     p[2]: parameters: k, l
     qdot[1]: rates of the coordinates
     vdot[1]: accelerations
     lam[0]: multipliers: reactions are G^T lam
   26 operations. Results must not overlap arguments. */
void p_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot, double
    *vdot, double *lam);

/* Kinetic energy, and potential energy of gravity and springs [J].
     t: time: t [s]
     q[1]: coordinates: A.angle [rad]
     v[1]: velocities: A.angle' [rad/s]
     p[2]: parameters: k, l
     kinetic[1]
     potential[1]
   18 operations. Results must not overlap arguments. */
void p_energies(double t, const double *q, const double *v, const double *p, double *kinetic, double
    *potential);

#ifdef __cplusplus
}
#endif

#endif
