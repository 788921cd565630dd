/* An elastic wall as an FMI 3 co-simulation FMU; compiled in the test. */
#include <stdlib.h>
#include "fmi3Functions.h"

typedef struct { double height, force, stiffness, ends_at; } Wall; /* value references 0 to 3 */

static void answer(Wall *wall) {
    wall->force = wall->height < 0.0 ? -wall->stiffness * wall->height : 0.0;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t n_required, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    return calloc(1, sizeof(Wall));
}

void fmi3FreeInstance(fmi3Instance wall) { free(wall); }

fmi3Status fmi3EnterInitializationMode(
    fmi3Instance wall, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
    fmi3Boolean stop_defined, fmi3Float64 stop) {
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance wall) {
    answer(wall);
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(
    fmi3Instance wall, const fmi3ValueReference references[], size_t count,
    const fmi3Float64 values[], size_t n_values) {
    for (size_t k = 0; k < count; ++k) ((double *)wall)[references[k]] = values[k];
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(
    fmi3Instance wall, const fmi3ValueReference references[], size_t count, fmi3Float64 values[],
    size_t n_values) {
    for (size_t k = 0; k < count; ++k) values[k] = ((double *)wall)[references[k]];
    return fmi3OK;
}

fmi3Status fmi3DoStep(
    fmi3Instance wall, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
    fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    Wall *own = wall;
    *event = *early = fmi3False;
    *last = time + step;
    *terminate = own->ends_at > 0.0 && *last > own->ends_at;
    answer(wall);
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance wall) { return fmi3OK; }
