"""An FMU for co-simulation, of FMI 2 or 3, written and compiled here: the pendulum of `problems`, solved exactly."""

import subprocess
import zipfile
from inspect import getmembers

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

COMMON = """
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { ANGLE, RATE, TORQUE, GRAVITY, RATE_0, DEGREES, SIZE };
typedef struct { double v[SIZE], time; } pendulum;
enum { OK = 0, ERROR = 3 };

static void begin(pendulum *s)
{
    *s = (pendulum){.v = {[ANGLE] = 0.1, [GRAVITY] = 9.81}};
}

static void *make(void)
{
    pendulum *s = malloc(sizeof *s);
    begin(s);
    return s;
}

static int go(pendulum *s, double t, double h)
{
    if (fabs(t - s->time) > 1e-9 || s->v[TORQUE] > 100.0) return ERROR;
    const double w = sqrt(s->v[GRAVITY]), middle = s->v[TORQUE] / s->v[GRAVITY];
    const double from = s->v[ANGLE] - middle, rate = s->v[RATE];
    s->v[ANGLE] = middle + from * cos(w * h) + rate / w * sin(w * h);
    s->v[RATE] = rate * cos(w * h) - from * w * sin(w * h);
    s->time = t + h;
    return OK;
}

static int begun(pendulum *s) { s->v[RATE] = s->v[RATE_0]; return OK; }
static int put(pendulum *s, const unsigned *r, size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++) s->v[r[i]] = v[i];
    return OK;
}
static int get(pendulum *s, const unsigned *r, size_t n, double *v)
{
    s->v[DEGREES] = s->v[ANGLE] * 57.29577951308232;
    for (size_t i = 0; i < n; i++) v[i] = s->v[r[i]];
    return OK;
}
"""
FMI2 = """
void *fmi2Instantiate(const char *a, int k, const char *g, const char *r, const void *c, int v, int l)
{ return make(); }
void fmi2FreeInstance(void *s) { free(s); }
int fmi2Reset(void *s) { begin(s); return OK; }
int fmi2SetupExperiment(void *s, int d, double e, double t, int b, double f) { return OK; }
int fmi2EnterInitializationMode(void *s) { return OK; }
int fmi2ExitInitializationMode(void *s) { return begun(s); }
int fmi2SetReal(void *s, const unsigned *r, size_t n, const double *v) { return put(s, r, n, v); }
int fmi2GetReal(void *s, const unsigned *r, size_t n, double *v) { return get(s, r, n, v); }
int fmi2DoStep(void *s, double t, double h, int b) { return go(s, t, h); }
"""
FMI3 = """
void *fmi3InstantiateCoSimulation(const char *a, const char *g, const char *r, bool v, bool l, bool e, bool y,
    const unsigned *i, size_t n, void *o, void *m, void *u) { return make(); }
void fmi3FreeInstance(void *s) { free(s); }
int fmi3Reset(void *s) { begin(s); return OK; }
int fmi3EnterInitializationMode(void *s, bool d, double e, double t, bool b, double f) { return OK; }
int fmi3ExitInitializationMode(void *s) { return begun(s); }
int fmi3SetFloat64(void *s, const unsigned *r, size_t n, const double *v, size_t m) { return put(s, r, n, v); }
int fmi3GetFloat64(void *s, const unsigned *r, size_t n, double *v, size_t m) { return get(s, r, n, v); }
int fmi3DoStep(void *s, double t, double h, bool b, bool *event, bool *end, bool *early, double *last)
{
    *event = *early = false;
    *end = ((pendulum *)s)->v[TORQUE] > 50.0;
    const int status = go(s, t, h);
    *last = ((pendulum *)s)->time;
    return status;
}
"""
TABLE = (
    ("angle", 0, 'causality="output" variability="continuous" initial="exact"', "0.1", "rad"),
    ("rate", 1, 'causality="output" variability="continuous"', None, "rad/s"),
    ("torque", 2, 'causality="input" variability="continuous"', "0", "N.m"),
    ("gravity", 3, 'causality="parameter" variability="tunable"', "9.81", "m/s2"),
    ("rate_0", 4, 'causality="parameter" variability="fixed"', "0", "rad/s"),
    ("angle.degrees", 5, 'causality="local" variability="continuous"', None, "deg"),
)


def description(version):
    """The file modelDescription.xml."""
    units = "".join(f'<Unit name="{unit}"/>' for unit in sorted({row[4] for row in TABLE}))
    begin = "<UnitDefinitions>" + units + "</UnitDefinitions>"
    starts = [f' start="{start}"' if start is not None else "" for *_, start, _ in TABLE]
    if version == 2:
        variables = "".join(
            f'<ScalarVariable name="{name}" valueReference="{r}" {what}><Real{start} unit="{unit}"/></ScalarVariable>'
            for (name, r, what, _, unit), start in zip(TABLE, starts, strict=True)
        )
        outputs = '<Outputs><Unknown index="1"/><Unknown index="2"/></Outputs>'
        unknown = '<InitialUnknowns><Unknown index="2"/></InitialUnknowns>'
        return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="their pendulum" guid="token">
<CoSimulation modelIdentifier="pendulum" canHandleVariableCommunicationStepSize="true"/>
{begin}<ModelVariables>{variables}</ModelVariables>
<ModelStructure>{outputs}{unknown}</ModelStructure></fmiModelDescription>"""
    variables = "".join(
        f'<Float64 name="{name}" valueReference="{r}" {what}{start} unit="{unit}"/>'
        for (name, r, what, _, unit), start in zip(TABLE, starts, strict=True)
    )
    variables += '<Float64 name="time" valueReference="6" causality="independent" variability="continuous"/>'
    outputs = '<Output valueReference="0"/><Output valueReference="1"/>'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="their pendulum" instantiationToken="token">
<CoSimulation modelIdentifier="pendulum" canHandleVariableCommunicationStepSize="true"/>
{begin}<ModelVariables>{variables}</ModelVariables>
<ModelStructure>{outputs}<InitialUnknown valueReference="1"/></ModelStructure></fmiModelDescription>"""


def build(compiler, folder, version):
    """Compile and pack it; its path."""
    own, kind = (FMI2, FMU2Slave) if version == 2 else (FMI3, FMU3Slave)
    # FMPy wants to find all functions that there are.
    missing = [
        name for name, _ in getmembers(kind) if name.startswith("fmi") and f" {name}(" not in own.replace("*", " ")
    ]
    source = folder / "pendulum.c"
    source.write_text(COMMON + own + "".join(f"int {name}(void) {{ return ERROR; }}\n" for name in missing))
    library = folder / f"pendulum{fmpy.sharedLibraryExtension}"
    subprocess.run([*compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-lm"], check=True)
    file = folder / f"pendulum{version}.fmu"
    with zipfile.ZipFile(file, "w") as packed:
        packed.writestr("modelDescription.xml", description(version))
        place = fmpy.platform if version == 2 else fmpy.platform_tuple
        packed.write(library, f"binaries/{place}/{library.name}")
    return file
