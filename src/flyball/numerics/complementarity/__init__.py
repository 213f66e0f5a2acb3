"""Complementarity problems, one solver per file: contact impulses in friction cones, small dense problems.

The solvers use no body data. The contact problem (`contact_problem`) is an operator from impulses to velocities
(`contact_operator`) with cones of admissible impulses (`cone_projection`). Solvers: `gauss_seidel`, `jacobi`,
`apgd`, `barzilai_borwein` (first order; they share `packed_contacts` and `gradient_steps`), `newton`, `admm`
(second order, with a sparse factor; they share `island_rows` and `proximal_rows`), `friction_pyramid` (pyramids
in place of cones). A new solver is a file with a kernel and a line in
`solver_choice.SOLVERS`.

The small dense problem (`dense_problem`, `dense_solver`) decides which rows stick, slide or separate.
`solve_history` computes residuals over the iterations of any solver.
`interior_point` and `douglas_rachford` find indeterminate forces within their cones.

Imports: NumPy, `compiler/`, `math/`, `numerics/graphs`, `numerics/thread_team`.

Coulomb's law differs from the convex problem. Gauss-Seidel solves it directly; Newton alternates convex problems with
De Saxce's terms and Newton steps on the law; ADMM updates these terms. Newton stores the impulses as multipliers
(method of multipliers), so that its compliance does not affect the solution. The dense problem is scaled to a unit
diagonal and softened by 1e-9. States are decided on the softened problem; refinement then removes the softening.
"""
