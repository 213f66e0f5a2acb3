"""A functional mock-up unit written by hand in C: x += gain u h at each step, y = x + direct u, slow = x."""

from __future__ import annotations

import platform
import subprocess
import zipfile

BODY = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
enum { U, GAIN, DIRECT, FAIL_AT, BROKEN, FIXED, Y, SLOW, VALUES };
static const double start[VALUES] = {0.0, 1.0, 0.0, 1e9, 0.0, 3.0, 0.0, 0.0};
typedef struct { double v[VALUES]; double t; } Unit;
static void note(const char *what)
{
    const char *path = getenv("UNIT_LOG");
    FILE *f = path ? fopen(path, "a") : 0;
    if (f) { fputs(what, f); fclose(f); }
}
static Unit *made(void)
{
    Unit *s = malloc(sizeof(Unit));
    memcpy(s->v, start, sizeof start);
    s->t = 0.0;
    note("+");
    return s;
}
static double get(Unit *s, unsigned k)
{
    if (k == Y) return s->v[BROKEN] != 0.0 ? NAN : s->v[SLOW] + s->v[DIRECT] * s->v[U];
    return s->v[k];
}
static int step(Unit *s, double t, double h)
{
    if (fabs(t - s->t) > 1e-9) return 3;
    if (t + h > s->v[FAIL_AT]) return 3;
    s->v[SLOW] += s->v[GAIN] * s->v[U] * h;
    s->t = t + h;
    return 0;
}
"""
FMI2 = r"""
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger logger; void *a, *b, *c, *environment; } Callbacks;
static Logger log_2;
#define NOT(name) int fmi2##name(void) { return 3; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *n, int kind, const char *id, const char *r, const Callbacks *f, int v, int l)
{ log_2 = f->logger; return strcmp(id, "{unit}") ? 0 : made(); }
void fmi2FreeInstance(void *s) { note("-"); free(s); }
int fmi2SetupExperiment(void *s, int d, double tol, double t, int e, double end) { ((Unit *)s)->t = t; return 0; }
int fmi2EnterInitializationMode(void *s) { return 0; }
int fmi2ExitInitializationMode(void *s) { return 0; }
int fmi2Terminate(void *s) { note("t"); return 0; }
int fmi2GetReal(void *s, const unsigned *r, size_t n, double *x)
{ for (size_t k = 0; k < n; k++) x[k] = get(s, r[k]); return 0; }
int fmi2SetReal(void *s, const unsigned *r, size_t n, const double *x)
{ for (size_t k = 0; k < n; k++) ((Unit *)s)->v[r[k]] = x[k]; return 0; }
int fmi2DoStep(void *s, double t, double h, int p)
{ int e = step(s, t, h); if (e) log_2(0, "unit", 3, "error", "too hot at %g", t + h); return e; }
NOT(SetDebugLogging) NOT(Reset) NOT(GetInteger) NOT(GetBoolean) NOT(GetString) NOT(SetInteger) NOT(SetBoolean)
NOT(SetString) NOT(GetFMUstate) NOT(SetFMUstate) NOT(FreeFMUstate) NOT(SerializedFMUstateSize) NOT(SerializeFMUstate)
NOT(DeSerializeFMUstate) NOT(GetDirectionalDerivative) NOT(SetRealInputDerivatives) NOT(GetRealOutputDerivatives)
NOT(CancelStep) NOT(GetStatus) NOT(GetRealStatus) NOT(GetIntegerStatus) NOT(GetBooleanStatus) NOT(GetStringStatus)
"""
FMI3 = r"""
#include <stdbool.h>
#include <stdint.h>
typedef void (*Logger)(void *, int, const char *, const char *);
static Logger log_3;
#define NOT(name) int fmi3##name(void) { return 3; }
const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateCoSimulation(const char *n, const char *id, const char *r, bool v, bool l, bool e, bool early,
                                  const uint32_t *q, size_t nq, void *env, Logger f, void *update)
{ log_3 = f; return strcmp(id, "{unit}") ? 0 : made(); }
void fmi3FreeInstance(void *s) { note("-"); free(s); }
int fmi3EnterInitializationMode(void *s, bool d, double tol, double t, bool e, double end) { ((Unit *)s)->t = t; return 0; }
int fmi3ExitInitializationMode(void *s) { return 0; }
int fmi3Terminate(void *s) { note("t"); return 0; }
int fmi3GetFloat64(void *s, const uint32_t *r, size_t n, double *x, size_t m)
{ for (size_t k = 0; k < n; k++) x[k] = get(s, r[k]); return 0; }
int fmi3SetFloat64(void *s, const uint32_t *r, size_t n, const double *x, size_t m)
{ for (size_t k = 0; k < n; k++) ((Unit *)s)->v[r[k]] = x[k]; return 0; }
int fmi3DoStep(void *s, double t, double h, bool p, bool *event, bool *ends, bool *early, double *last)
{ int e = step(s, t, h); if (e) log_3(0, 3, "error", "too hot"); *event = *ends = *early = false; *last = t + h; return e; }
"""


def description(version: int, more: str = "", kind: str = "CoSimulation", extra: str = "") -> str:
    """The modelDescription.xml; ``more`` are further variables."""
    real, name = ("Real", "ScalarVariable") if version == 2 else ("Float64", "")

    def variable(k, text, attributes, number):
        if version == 2:
            return f'<ScalarVariable name="{text}" valueReference="{k}" {attributes}><Real {number}/></ScalarVariable>'
        return f'<Float64 name="{text}" valueReference="{k}" {attributes} {number}/>'

    parameter = 'causality="parameter" variability="{}" initial="exact"'
    parts = [
        variable(0, "u", 'causality="input" variability="continuous"', 'start="0" unit="1/min"'),
        variable(1, "gain", parameter.format("tunable"), 'start="1"'),
        variable(2, "direct", parameter.format("fixed"), 'start="0"'),
        variable(3, "fail.at", parameter.format("fixed"), 'start="1e9" unit="s"'),
        variable(4, "broken", parameter.format("fixed"), 'start="0"'),
        variable(5, "fixed", parameter.format("fixed"), 'start="3"'),
        variable(6, "shaft.y", 'causality="output" variability="continuous" initial="calculated"', 'unit="kN"'),
        variable(7, "slow", 'causality="output" variability="continuous" initial="calculated"', ""),
    ]
    identity = 'guid="{unit}"' if version == 2 else 'instantiationToken="{unit}"'
    outputs = (
        '<Outputs><Unknown index="7" dependencies="1"/><Unknown index="8" dependencies=""/></Outputs>'
        if version == 2
        else '<Output valueReference="6" dependencies="0"/><Output valueReference="7" dependencies=""/>'
    )
    return (
        f'<fmiModelDescription fmiVersion="{version}.0" modelName="unit" {identity}>'
        f'<{kind} modelIdentifier="unit" {extra}/>'
        '<UnitDefinitions><Unit name="1/min"><BaseUnit rad="1" s="-1" factor="0.10471975511965977"/></Unit>'
        '<Unit name="kN"/><Unit name="s"><BaseUnit s="1"/></Unit></UnitDefinitions>'
        f"<ModelVariables>{''.join(parts)}{more}</ModelVariables><ModelStructure>{outputs}</ModelStructure>"
        "</fmiModelDescription>"
    )


def pack(path, version: int, library: bytes, text: str | None = None, folder: str | None = None):
    """Write a unit of a compiled library; ``folder`` for one of another platform."""
    machine = platform.machine()
    own = "linux64" if version == 2 else f"{machine}-linux"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description(version) if text is None else text)
        archive.writestr(f"binaries/{folder or own}/unit.so", library)
    return path


def compiled(folder, version: int) -> bytes:
    """The library of the unit, by gcc."""
    code = BODY + (FMI2 if version == 2 else FMI3 + others_of_fmi3())
    source, library = folder / f"unit{version}.c", folder / f"unit{version}.so"
    source.write_text(code)
    subprocess.run(["gcc", "-shared", "-fPIC", "-w", str(source), "-o", str(library), "-lm"], check=True)
    return library.read_bytes()


def others_of_fmi3() -> str:
    """Functions of FMI 3 that the unit does not have, but whose names fmpy looks up."""
    from fmpy.fmi3 import FMU3Slave

    own = FMI3 + BODY
    names = [n for n in dir(FMU3Slave) if n.startswith("fmi3") and f"{n}(" not in own]
    return "\n".join(f"NOT({n.removeprefix('fmi3')})" for n in names)
