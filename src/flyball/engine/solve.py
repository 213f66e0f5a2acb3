"""Solve of [M G^T; G 0] [x; -lam] = [f; gamma] with redundant or singular rows; coordinate partitioning.

Where M is constant and block diagonal, the Schur complement S = G M^-1 G^T is used; otherwise the quasi-definite matrix
[M G^T; G -delta]; for a forest without rows, articulated bodies. The first two are regularised by a small part of each
row's natural size D, and refined until the residual of G x = gamma passes or stops falling (a proximal-point iteration:
of all multipliers it finds those with the least sum of D_k lam_k^2).

The regularisation is not smaller than needed. Near a singular position a row combination with singular value s answers
a rounding error e with e / s. Refinement removes the regularisation from all well determined components within a few
passes, while undetermined ones grow by no more than passes * s / delta.

Coordinate partitioning: with G = [G_d G_i], dependent and independent columns, dv_d = B dv_i where B = -G_d^-1 G_i
(Wehage and Haug 1982, *Journal of Mechanical Design* 104, 247-255). Positions and velocities are solved for the
dependent coordinates; the independent ones keep their integrated values. They are exchanged when another set is better
conditioned.
"""

from __future__ import annotations

from ..compiler.formulas import formula
from ..math.scalar import choose, larger, magnitude
from ..math.vec import load9, mv
from ..numerics.sparse_factorisation import ldl_factor, ldl_solve
from ..tables.table_definitions import (
    COUPLED,
    FACTOR,
    REFINE,
    REUSE,
    ROW_RESIDUAL,
    SCHUR,
    STEP,
    STEP_UNLOADED,
)
from .articulated_body import factor_articulated, mass_entries, solve_articulated
from .calls import call_generated
from .rows import row_times, size_inactive_rows

MAX_REFINEMENTS = 20
DIAGONAL_ROUNDING = 1e-13  # relative to a row's own diagonal entry: rounding due to slender bodies
RIGID_MASS = 1e30  # factor on the mass of an independent coordinate where only dependent ones may move
MULTIPLIER_ROUNDING = 1e-15  # of D_k |lam_k|: a residual that refinement cannot reduce
STALLED = 0.7  # refinement stops after a pass that leaves more than this fraction of the residual


@formula
def apply_inverse_mass(S, b, x, at, out, to):
    """out[to:] = M_b^-1 x[at:] for a body with constant mass block."""
    m = S.bodies.inverse_mass[b]
    n = S.tree.nv[b]
    out[to] = m * x[at]
    out[to + 1] = m * x[at + 1]
    if n == 3:  # the angle of a planar body, z of a point mass
        out[to + 2] = S.bodies.inverse_inertia[b, 8] * x[at + 2]
    elif n == 6:
        r = mv(load9(S.bodies.inverse_inertia, b, 0), (x[at + 3], x[at + 4], x[at + 5]))
        out[to + 2] = m * x[at + 2]
        for i in range(3):
            out[to + 3 + i] = r[i]


@formula
def factor(S, W):
    """Factor the matrix of the solve at the kinematics and rows now in W. Returns 0, or 1 + a singular unknown."""
    W.counts.factorisations += 1
    if W.generated[FACTOR] != 0:
        return int(call_generated(W.generated[FACTOR], S, W, 0.0, W.A, W.A, W.A, W.A))
    if S.sizes.solver == SCHUR:
        return factor_schur(S, W)
    if S.sizes.solver == COUPLED:
        return factor_coupled(S, W)
    return factor_articulated(S, W)


@formula
def rows_by_inverse_mass(S, W):
    """H = M^-1 G^T for the rows now in W."""
    for e in range(S.blocks.body.shape[0]):
        at = S.blocks.entry[e]
        if W.options.partitioned > 0.0:
            dependent_rows_by_inverse_mass(S, W, S.blocks.body[e], at)
        else:
            apply_inverse_mass(S, S.blocks.body[e], W.G, at, W.H, at)


@formula
def dependent_rows_by_inverse_mass(S, W, b, at):
    """Block of M^-1 G^T with the inverse masses of dependent coordinates only: the independent ones do not move."""
    n = S.tree.nv[b]
    for k in range(n):
        per = S.bodies.inverse_mass[b] if k <= n // 3 else S.bodies.inverse_reference_inertia[b]
        W.H[at + k] = per * W.G[at + k] if W.velocities.partition[S.tree.v[b] + k].real > 0.0 else 0.0


@formula
def natural_row_sizes(S, W):
    """Diagonal entries of G M^-1 G^T as they would be if every body were compact: the scale of small values.

    A slender body makes entries a million times larger along its own axis, which are no measure of the others.
    """
    for k in range(S.rows.law.shape[0]):
        W.rows.diagonal[k] = 0.0
    for e in range(S.blocks.body.shape[0]):
        b, at, k = S.blocks.body[e], S.blocks.entry[e], S.blocks.row[e]
        n = S.tree.nv[b]
        shift = W.G[at] * W.G[at] + W.G[at + 1] * W.G[at + 1]
        turn = 0.0 * shift
        if n == 6:
            shift += W.G[at + 2] * W.G[at + 2]
            turn += W.G[at + 3] * W.G[at + 3] + W.G[at + 4] * W.G[at + 4] + W.G[at + 5] * W.G[at + 5]
        elif n == 3:
            turn += W.G[at + 2] * W.G[at + 2]
        W.rows.diagonal[k] += shift * S.bodies.inverse_reference_mass[b] + turn * S.bodies.inverse_reference_inertia[b]
    size_inactive_rows(S, W)


@formula
def reuse_factor(S, W):
    """Keep the last factor for rows that have changed little, as a preconditioner of the refinement."""
    if S.sizes.solver == SCHUR:
        if W.generated[REUSE] != 0:
            call_generated(W.generated[REUSE], S, W, 0.0, W.A, W.A, W.A, W.A)
        else:
            rows_by_inverse_mass(S, W)


@formula
def factor_schur(S, W):
    """Form S = G M^-1 G^T block by block and factor it."""
    rows_by_inverse_mass(S, W)
    for e in range(W.A.shape[0]):
        W.A[e] = 0.0
    for e in range(S.pairs.first.shape[0]):
        i, j, length, place = S.pairs.first[e], S.pairs.second[e], S.pairs.length[e], S.pairs.place[e]
        s = W.G[i] * W.H[j]
        for k in range(1, length):
            s += W.G[i + k] * W.H[j + k]
        W.A[place] += s
    natural_row_sizes(S, W)
    for k in range(S.rows.law.shape[0]):
        place = S.ldl.Ap[S.ldl.perm[k] + 1] - 1
        W.A[place] += S.scales.regularization * W.rows.diagonal[k] + DIAGONAL_ROUNDING * W.A[place]
    return ldl_factor(S.ldl, W.A, W.L, W.ldl.inverse_diagonal, W.ldl.scratch)


@formula
def factor_coupled(S, W):
    """Factor [M G^T; G -delta diag(G M^-1 G^T)], with the diagonal of M in place of M in delta.

    For delta, the sizes that entries of G have for the length of a body are added to them: the size of a row along
    which the forest cannot move, now or ever, must not vanish with its entries.
    """
    nv = W.velocities.solved.shape[0]
    per = W.velocities.scratch_1
    mass_entries(S, W)
    for e in range(S.mass_entries.row.shape[0]):
        d = S.mass_entries.row[e]
        own = d == S.mass_entries.column[e]
        if own:
            per[d] = 1.0 / W.M[e]
        if W.options.partitioned > 0.0:  # masses of the dependent coordinates alone
            W.M[e] *= (RIGID_MASS if W.velocities.partition[d].real < 0.0 else 1.0) if own else 0.0
        W.A[S.mass_entries.place[e]] = W.M[e]
    for k in range(S.rows.law.shape[0]):
        s = 0.0 * W.rows.diagonal[k]
        for e in range(S.row_start[k], S.row_start[k + 1]):
            W.A[S.pairs.place[e]] = W.G[e]
            if S.pairs.place[e] < S.ldl.Ai.shape[0]:  # prescribed velocities do not count
                s += (W.G[e] * W.G[e] + S.entry_sizes[e] * S.entry_sizes[e]) * per[S.column[e]]
        s = choose(s, s, s + 1.0)
        W.rows.diagonal[k] = s
        W.A[S.ldl.Ap[S.ldl.perm[nv + k] + 1] - 1] = -S.scales.regularization * s
    return ldl_factor(S.ldl, W.A, W.L, W.ldl.inverse_diagonal, W.ldl.scratch)


@formula
def solve(S, W, f, gamma, x, lam, loaded, refinements):
    """Solve for x and lam with the factor in W; ``f`` (taken as zero unless ``loaded``) and ``gamma`` are not changed.

    Prescribed velocities have the accelerations in `W.velocities.prescribed` if loaded, else zero. Where M is
    semidefinite, M + E is factored in its place and the refinement removes E again. Returns the remaining residual,
    relative to the size of its terms.
    """
    W.counts.solves += 1
    if W.generated[STEP] != 0:
        return solve_generated(S, W, f, gamma, x, lam, loaded, refinements)
    for d in range(x.shape[0]):
        x[d] = W.velocities.prescribed[d] if loaded else 0.0
    for k in range(lam.shape[0]):
        lam[k] = 0.0
        W.rows.scratch_1[k] = gamma[k]
    if S.sizes.solver == SCHUR:
        return solve_schur(S, W, f, gamma, x, lam, loaded, refinements)
    if S.sizes.solver == COUPLED:
        return solve_coupled(S, W, f, gamma, x, lam, loaded, refinements)
    solve_articulated(S, W, f, x, W.velocities.effort)
    return 0.0


@formula
def solve_generated(S, W, f, gamma, x, lam, loaded, refinements):
    """Solve by code generated for the mechanism, with refinement passes until the residual passes or stops falling."""
    worst = call_generated(W.generated[(STEP if loaded else STEP_UNLOADED)], S, W, 0.0, f, gamma, x, lam)
    last = last_off = 1e300
    for _ in range(refinements + 1 if W.generated[REFINE] != 0 else 0):
        worst = call_generated(W.generated[REFINE], S, W, 0.0, f, gamma, x, lam)
        off = W.flat[ROW_RESIDUAL].real
        if not worst > W.options.solve_tolerance or is_stalled(W, lam, worst, last, off, last_off):
            break
        last, last_off = worst, off
    return worst


@formula
def is_stalled(W, lam, worst, last, off, last_off):
    """Whether another pass is useless, by the residuals that `residual_coupled` returns, now and after the last pass.

    Where all accelerations are zero except for residuals, as at rest, the relative residual does not fall however small
    they become. There gamma - G x has to fall, as long as it is above the rounding that the multipliers cause in
    x = M^-1 (f + G^T lam).
    """
    if not worst > STALLED * last:
        return False
    if off > STALLED * last_off:
        return True
    for k in range(lam.shape[0]):
        rounding = MULTIPLIER_ROUNDING * magnitude(W.rows.diagonal[k] * lam[k])
        if magnitude(W.rows.scratch_1[k]) > rounding:
            return False
    return True


@formula
def solve_schur(S, W, f, gamma, x, lam, loaded, refinements):
    """Solve through S = G M^-1 G^T: one pass, then as many refinement passes as needed."""
    rhs = W.velocities.scratch_2
    semidefinite = S.scales.semidefinite > 0.0 and not W.options.partitioned > 0.0
    for d in range(x.shape[0]):
        rhs[d] = f[d] if loaded else 0.0
    if loaded and not semidefinite:
        for b in range(S.tree.parent.shape[0]):
            apply_inverse_mass(S, b, f, S.tree.v[b], x, S.tree.v[b])
        for k in range(lam.shape[0]):
            W.rows.scratch_1[k] = gamma[k] - row_times(S, W, k, x)
    pass_schur(S, W, rhs, x, lam, semidefinite)
    worst = 0.0
    last = last_off = 1e300
    for _ in range(refinements):
        worst, off = residual_schur(S, W, gamma, x, rhs, semidefinite)
        if not worst > W.options.solve_tolerance or is_stalled(W, lam, worst, last, off, last_off):
            break
        last, last_off = worst, off
        pass_schur(S, W, rhs, x, lam, semidefinite)
    return worst


@formula
def pass_schur(S, W, rhs, x, lam, loaded):
    """Add to x and lam one solve for the residual in `W.rows.scratch_1` and, if ``loaded``, for rhs, which is cleared.

    The change of x is left in `W.velocities.scratch_1`.
    """
    dx = W.velocities.scratch_1
    r = W.rows.scratch_1
    z = W.ldl.right_hand_side
    for d in range(x.shape[0]):
        dx[d] = 0.0
    if loaded:
        for b in range(S.tree.parent.shape[0]):
            apply_inverse_mass(S, b, rhs, S.tree.v[b], dx, S.tree.v[b])
    for k in range(r.shape[0]):
        z[S.ldl.perm[k]] = r[k] - row_times(S, W, k, dx) if loaded else r[k]
    ldl_solve(S.ldl, W.L, W.ldl.inverse_diagonal, z)
    for k in range(r.shape[0]):
        mu = z[S.ldl.perm[k]]
        lam[k] += mu
        for e in range(S.row_start[k], S.row_start[k + 1]):
            dx[S.column[e]] += W.H[e] * mu
    for d in range(x.shape[0]):
        x[d] += dx[d]
        rhs[d] = 0.0


@formula
def solve_coupled(S, W, f, gamma, x, lam, loaded, refinements):
    """Solve with [M G^T; G -delta]: refinement passes until both equations are satisfied or stop improving."""
    rhs = W.velocities.scratch_2
    worst = 1.0
    last = last_off = 1e300
    for d in range(x.shape[0]):
        rhs[d] = 0.0
    if loaded:
        residual_coupled(S, W, f, gamma, x, lam, rhs, loaded)
    for _ in range(refinements):
        worst, off = pass_coupled(S, W, f, gamma, x, lam, rhs, loaded)
        if not worst > W.options.solve_tolerance or is_stalled(W, lam, worst, last, off, last_off):
            break
        last, last_off = worst, off
    return worst


@formula
def pass_coupled(S, W, f, gamma, x, lam, rhs, loaded):
    """Add to x and lam one solve for the residuals of both equations; returns what `residual_coupled` does."""
    z = W.ldl.right_hand_side
    nv = x.shape[0]
    for d in range(nv):
        z[S.ldl.perm[d]] = rhs[d]
    for k in range(lam.shape[0]):
        z[S.ldl.perm[nv + k]] = W.rows.scratch_1[k]
    ldl_solve(S.ldl, W.L, W.ldl.inverse_diagonal, z)
    for d in range(nv):
        x[d] += z[S.ldl.perm[d]]
    for k in range(lam.shape[0]):
        lam[k] -= z[S.ldl.perm[nv + k]]
    return residual_coupled(S, W, f, gamma, x, lam, rhs, loaded)


@formula
def residual_schur(S, W, gamma, x, rhs, semidefinite):
    """Residuals of both equations after a pass through S; returns what `residual_coupled` does."""
    worst, off = row_residual(S, W, gamma, x)
    if semidefinite:
        worst = larger(worst, excess_mass_residual(S, W.velocities.scratch_1, rhs, x))
    return worst, off


@formula
def row_residual(S, W, gamma, x):
    """R = gamma - G x into `W.rows.scratch_1`.

    Returns its largest entry relative to its terms, and that entry, as a length.
    """
    off = 0.0
    size = 1e-300
    for k in range(gamma.shape[0]):
        s = gamma[k]
        a = magnitude(gamma[k])
        for e in range(S.row_start[k], S.row_start[k + 1]):
            p = W.G[e] * x[S.column[e]]
            s -= p
            a += magnitude(p)
        W.rows.scratch_1[k] = s
        off = larger(off, magnitude(s) * S.row_levers[k])
        size = larger(size, a * S.row_levers[k])
    return off / size, off


@formula
def residual_coupled(S, W, f, gamma, x, lam, rhs, loaded):
    """Residuals of the coupled equations: gamma - G x into `W.rows.scratch_1`, f - M x + G^T lam into rhs.

    Returns the largest entry of either relative to its terms, and that of gamma - G x as a length. Forces and torques
    are compared by their work along the mechanism's length and a radian. The residuals of prescribed velocities are the
    efforts of their drivers: they go to `W.velocities.effort`.
    """
    size = 1e-300
    for d in range(x.shape[0]):
        rhs[d] = f[d] if loaded else 0.0
        size = larger(size, magnitude(rhs[d]) * S.velocity_units[d])
    for e in range(S.mass_entries.row.shape[0]):
        i, j = S.mass_entries.row[e], S.mass_entries.column[e]
        p = W.M[e] * x[j]
        rhs[i] -= p
        size = larger(size, magnitude(p) * S.velocity_units[i])
        if i != j:
            rhs[j] -= W.M[e] * x[i]
    wide = 1e-300
    off = 0.0
    for k in range(lam.shape[0]):
        s = gamma[k]
        a = magnitude(s)
        for e in range(S.row_start[k], S.row_start[k + 1]):
            d = S.column[e]
            p = W.G[e] * lam[k]
            rhs[d] += p
            size = larger(size, magnitude(p) * S.velocity_units[d])
            p = W.G[e] * x[d]
            s -= p
            a += magnitude(p)
        W.rows.scratch_1[k] = s
        off = larger(off, magnitude(s) * S.row_levers[k])
        wide = larger(wide, a * S.row_levers[k])
    for b in range(S.tree.parent.shape[0]):
        if S.tree.law[b] >= 0:
            d = S.tree.v[b]
            W.velocities.effort[d] = -rhs[d]
            rhs[d] = 0.0
    worst = 0.0
    for d in range(x.shape[0]):
        worst = larger(worst, magnitude(rhs[d]) * S.velocity_units[d])
    return larger(worst / size, off / wide), off


@formula
def excess_mass_residual(S, dx, rhs, x):
    """E dx into ``rhs``: the force of the regularising mass in the last step. Returns its size relative to M x."""
    worst = 0.0
    size = 1e-300
    for b in range(S.tree.parent.shape[0]):
        v0 = S.tree.v[b]
        n = S.tree.nv[b]
        if n == 3:
            rhs[v0 + 2] = S.bodies.excess_inertia[b, 8] * dx[v0 + 2]
            worst = larger(worst, magnitude(rhs[v0 + 2]))
        elif n == 6:
            t = mv(load9(S.bodies.excess_inertia, b, 0), (dx[v0 + 3], dx[v0 + 4], dx[v0 + 5]))
            rhs[v0 + 2] = S.bodies.excess_mass[b] * dx[v0 + 2]
            for i in range(3):
                rhs[v0 + 3 + i] = t[i]
                worst = larger(worst, magnitude(t[i]))
        for i in range(2):
            rhs[v0 + i] = S.bodies.excess_mass[b] * dx[v0 + i]
            worst = larger(worst, magnitude(rhs[v0 + i]) * S.scales.length)
            size = larger(size, S.bodies.mass[b] * magnitude(x[v0 + i]) * S.scales.length)
    return worst / size


# a dependent coordinate that moves by more than this times an independent one is exchanged with it
EXCHANGE_RATIO = 4.0


@formula
def exchange_coordinates(S, W):
    """Exchange coordinates as long as an entry of B, scaled by its coordinates' sizes, is above `EXCHANGE_RATIO`.

    Each exchange multiplies the volume |det G_d| by that entry, so this ends, and the pivots stay away from zero (the
    exchange is that of Goreinov, Tyrtyshnikov and Zamarashkin 1997, for submatrices of large volume).
    """
    way = W.velocities.scratch_3
    r = W.rows.scratch_2
    n = way.shape[0]
    for _ in range(n):
        if r.shape[0] == 0 or factor(S, W) != 0:
            return
        most = EXCHANGE_RATIO
        out = -1
        taken = -1
        for i in range(n):
            size = -W.velocities.partition[i].real
            if size > 0.0:
                negative_column(S, W, i, r)
                solve(S, W, W.velocities.applied, r, way, W.rows.residual, False, MAX_REFINEMENTS)
                for d in range(n):
                    own = W.velocities.partition[d].real
                    if own > 0.0 and magnitude(way[d]) * size > most * own:
                        most = magnitude(way[d]) * size / own
                        out, taken = i, d
        if out < 0:
            return
        W.velocities.partition[out] = -W.velocities.partition[out]
        W.velocities.partition[taken] = -W.velocities.partition[taken]
        W.counts.exchanges += 1


@formula
def negative_column(S, W, i, out):
    """Write minus column i of G to ``out``."""
    for k in range(out.shape[0]):
        out[k] = 0.0
        for e in range(S.row_start[k], S.row_start[k + 1]):
            if S.column[e] == i:
                out[k] -= W.G[e]
