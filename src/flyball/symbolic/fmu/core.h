/* State of one instance of a mechanism, and the operations that FMI 2 and 3 share. SI units and radians. */
#ifndef FLYBALL_FMU_CORE_H
#define FLYBALL_FMU_CORE_H

#include <stddef.h>

#include "glue.h"

#define NX (NQ + NV + NZ)

/* The values by value reference: 0 is the time, then states, their rates, inputs, parameters and outputs. */
#define RATES_AT (1 + NX)
#define INPUTS_AT (RATES_AT + NX)
#define PARAMETERS_AT (INPUTS_AT + NU)
#define OUTPUTS_AT (PARAMETERS_AT + NP)
#define VALUES (OUTPUTS_AT + NY)

#define DRIFT 1e-8 /* change of positions, in their sizes, from which a projection interrupts the importer's integration */

typedef struct {
    double value[VALUES];
    double step;      /* of the integrator, its last proposal [s]; 0: none yet */
    double tolerance; /* relative, of a step of the integrator */
    int current;      /* whether rates and outputs belong to the other values */
    int initializing; /* parameters and states may be set */
} Instance;

void reset_instance(Instance *s);
void update_values(Instance *s);
void set_value(Instance *s, size_t k, double value);
int may_be_set(const Instance *s, size_t k);
double project(Instance *s);
int integrate(Instance *s, double end);

#endif
