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
#ifndef MECHANISM_H
#define MECHANISM_H

#ifdef __cplusplus
extern "C" {
#endif

extern const char *const mechanism_q_names[3];
extern const char *const mechanism_v_names[3];
extern const char *const mechanism_lam_names[1];
extern const double mechanism_q_start[3];
extern const double mechanism_v_start[3];
extern const double mechanism_places_start[1];

/* Poses of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     positions[1][3]: of f: origins [m], along the world's axes, row by row
     rotations[1][3][3]: their axes, as columns, row by row
   2 operations. Results must not overlap arguments. */
void mechanism_kinematics(double t, const double *q, double *positions, double *rotations);

/* Velocities of bodies' reference frames and of named frames.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     velocities[1][3]: of f: of origins [m/s], along the world's axes, row by row
     angular_velocities[1][3]: [rad/s], along the world's axes, row by row
   0 operations. Results must not overlap arguments. */
void mechanism_velocities(double t, const double *q, const double *v, double *velocities, double
    *angular_velocities);

/* qdot = T v.
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     T[3][3]: rates of the coordinates by the velocities, row by row
   0 operations. Results must not overlap arguments. */
void mechanism_T(const double *q, double *T);

/* Mass matrix.
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     M[3][3]: symmetric [kg, kg m, kg m^2], row by row
   0 operations. Results must not overlap arguments. */
void mechanism_M(const double *q, double *M);

/* All forces but reactions along the velocities, gyroscopic ones included.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     f[3]: [N, N m]
   0 operations. Results must not overlap arguments. */
void mechanism_f(double t, const double *q, const double *v, double *f);

/* Constraints, g = 0.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     places[1]: places of followers on their curves: c.place [m]
     g[1]: [m, rad, 1]; 0 for those of velocities only
   20 operations. Results must not overlap arguments. */
void mechanism_g(double t, const double *q, const double *places, double *g);

/* What constraints ask of velocities: G v = nu.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     nu[1]
   0 operations. Results must not overlap arguments. */
void mechanism_nu(double t, const double *q, double *nu);

/* Jacobian of the constraints along the velocities.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     places[1]: places of followers on their curves: c.place [m]
     G[1][3]: , row by row
   8 operations. Results must not overlap arguments. */
void mechanism_G(double t, const double *q, const double *places, double *G);

/* What constraints ask of accelerations: G vdot = gamma.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     places[1]: places of followers on their curves: c.place [m]
     gamma_2[1]
   36 operations. Results must not overlap arguments. */
void mechanism_gamma(double t, const double *q, const double *v, const double *places, double *gamma_2);

/* M vdot - f - G^T lam: zero along every motion.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     vdot[3]: accelerations: f.x'' [m/s^2], f.y'' [m/s^2], f.angle'' [rad/s^2]
     lam[1]: multipliers: c.lam_xy
     places[1]: places of followers on their curves: c.place [m]
     residual[3]: [N, N m]
   13 operations. Results must not overlap arguments. */
void mechanism_residual(double t, const double *q, const double *v, const double *vdot, const double *lam,
    const double *places, double *residual);

/* Accelerations and multipliers at a state with g = 0 and G v = nu.
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     places[1]: places of followers on their curves: c.place [m]
     qdot[3]: rates of the coordinates
     vdot[3]: accelerations
     lam[1]: multipliers: reactions are G^T lam
     placesdot[1]: rates of the places on curves
   78 operations. Results must not overlap arguments. */
void mechanism_right_hand_side(double t, const double *q, const double *v, const double *places, double *qdot,
    double *vdot, double *lam, double *placesdot);

/* Kinetic energy, and potential energy of gravity and springs [J].
     t: time: t [s]
     q[3]: coordinates: f.x [m], f.y [m], f.angle [rad]
     v[3]: velocities: f.x' [m/s], f.y' [m/s], f.angle' [rad/s]
     kinetic[1]
     potential[1]
   8 operations. Results must not overlap arguments. */
void mechanism_energies(double t, const double *q, const double *v, double *kinetic, double *potential);

#ifdef __cplusplus
}
#endif

#endif
