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
#ifndef SLIDER_CRANK_H
#define SLIDER_CRANK_H

#ifdef __cplusplus
extern "C" {
#endif

extern const char *const slider_crank_q_names[3];
extern const char *const slider_crank_v_names[3];
extern const char *const slider_crank_lam_names[3];
extern const char *const slider_crank_p_names[3];
extern const double slider_crank_q_start[3];
extern const double slider_crank_v_start[3];
extern const double slider_crank_p_values[3];

/* Poses of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     positions[3][3]: of crank, rod, slider: origins [m], along the world's axes, row by row
     rotations[3][3][3]: their axes, as columns, row by row
   24 operations. Results must not overlap arguments. */
void slider_crank_kinematics(double t, const double *q, const double *p, double *positions, double *rotations);

/* Velocities of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     p[3]: parameters: speed, crank, rod
     velocities[3][3]: of crank, rod, slider: of origins [m/s], along the world's axes, row by row
     angular_velocities[3][3]: [rad/s], along the world's axes, row by row
   30 operations. Results must not overlap arguments. */
void slider_crank_velocities(double t, const double *q, const double *v, const double *p, double *velocities,
    double *angular_velocities);

/* qdot = T v.
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     T[3][3]: rates of the coordinates by the velocities, row by row
   0 operations. Results must not overlap arguments. */
void slider_crank_T(const double *q, const double *p, double *T);

/* Mass matrix.
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     M[3][3]: symmetric [kg, kg m, kg m^2], row by row
   56 operations. Results must not overlap arguments. */
void slider_crank_M(const double *q, const double *p, double *M);

/* All forces but reactions along the velocities, gyroscopic ones included.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     p[3]: parameters: speed, crank, rod
     f[3]: [N, N m]
   73 operations. Results must not overlap arguments. */
void slider_crank_f(double t, const double *q, const double *v, const double *p, double *f);

/* Constraints, g = 0.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     g[3]: [m, rad, 1]; 0 for those of velocities only
   29 operations. Results must not overlap arguments. */
void slider_crank_g(double t, const double *q, const double *p, double *g);

/* Velocity constraints: G v = nu.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     nu[3]
   0 operations. Results must not overlap arguments. */
void slider_crank_nu(double t, const double *q, const double *p, double *nu);

/* Jacobian of the constraints along the velocities.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     p[3]: parameters: speed, crank, rod
     G[3][3]: , row by row
   27 operations. Results must not overlap arguments. */
void slider_crank_G(double t, const double *q, const double *p, double *G);

/* Acceleration constraints: G vdot = gamma.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     p[3]: parameters: speed, crank, rod
     gamma_2[3]
   42 operations. Results must not overlap arguments. */
void slider_crank_gamma(double t, const double *q, const double *v, const double *p, double *gamma_2);

/* M vdot - f - G^T lam: zero along every motion.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     vdot[3]: accelerations: A.angle'' [rad/s^2], B.angle'' [rad/s^2], D.displacement'' [m/s^2]
     lam[3]: multipliers: C.lam_nx, C.lam_ny, motor.effort [N*m]
     p[3]: parameters: speed, crank, rod
     residual[3]: [N, N m]
   134 operations. Results must not overlap arguments. */
void slider_crank_residual(double t, const double *q, const double *v, const double *vdot, const double *lam,
    const double *p, double *residual);

/* Accelerations and multipliers at a state with g = 0 and G v = nu.
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     p[3]: parameters: speed, crank, rod
     qdot[3]: rates of the coordinates
     vdot[3]: accelerations
     lam[3]: multipliers: reactions are G^T lam
   322 operations. Results must not overlap arguments. */
void slider_crank_right_hand_side(double t, const double *q, const double *v, const double *p, double *qdot,
    double *vdot, double *lam);

/* Kinetic energy, and potential energy of gravity and springs [J].
     t: time: t [s]
     q[3]: coordinates: A.angle [rad], B.angle [rad], D.displacement [m]
     v[3]: velocities: A.angle' [rad/s], B.angle' [rad/s], D.displacement' [m/s]
     p[3]: parameters: speed, crank, rod
     kinetic[1]
     potential[1]
   64 operations. Results must not overlap arguments. */
void slider_crank_energies(double t, const double *q, const double *v, const double *p, double *kinetic,
    double *potential);

#ifdef __cplusplus
}
#endif

#endif
