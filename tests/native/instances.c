/* Instances one after another, and refused calls: the memory that each leaves behind.
 *
 * FMI 2.0: instances LIBRARY GUID RESOURCES-URI COUNT; FMI 3.0, compiled with -DFMI3 and linked with the
 * FMU's library: instances TOKEN RESOURCES COUNT.  With -DSTATELESS nothing is saved.  Prints two numbers of bytes, per instance and per
 * refused call, by the count of the allocator, which Python asks with PYTHONMALLOC=malloc.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <malloc.h>
#include <math.h>

#if defined(FMI3)
#include "description.h"
#include "fmi3Functions.h"

static const char *token, *resources;

static void start(int count, char **arguments)
{
    CHECK(count == 4);
    token = arguments[1];
    resources = arguments[2];
    read_variables(resources);
}

static void *create(void)
{
    fmi3Instance c = fmi3InstantiateCoSimulation("robot", token, resources, false, false, false, false,
                                                 NULL, 0, NULL, NULL, NULL);
    CHECK(c != NULL);
    return c;
}

static void live(void *c)
{
    fmi3FMUState state = NULL;
    fmi3Boolean no;
    double last;
    CHECK(fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    CHECK(fmi3GetFMUState(c, &state) == fmi3OK);
    CHECK(fmi3DoStep(c, 0.0, 0.001, true, &no, &no, &no, &last) == fmi3OK);
    CHECK(fmi3SetFMUState(c, state) == fmi3OK);
    CHECK(fmi3FreeFMUState(c, &state) == fmi3OK);
    CHECK(fmi3Terminate(c) == fmi3OK);
}

static void refuse(void *c)
{
    fmi3ValueReference reference = 0;
    double force[3] = {0.0, 0.0, NAN};
    CHECK(fmi3SetFloat64(c, &reference, 1, force, 3) == fmi3Discard);
}

#define RELEASE fmi3FreeInstance
#else
#include "master.h"

#if !defined(STATELESS)
#define STATELESS 0
#endif

static void start(int count, char **arguments)
{
    start_master(count, arguments);
}

static void *create(void)
{
    return new_instance();
}

static void live(void *c)
{
    fmi2FMUstate state = NULL;
    CHECK(ffmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(ffmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(ffmi2ExitInitializationMode(c) == fmi2OK);
    CHECK(STATELESS || ffmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(ffmi2DoStep(c, 0.0, 0.001, fmi2True) == fmi2OK);
    CHECK(STATELESS || ffmi2SetFMUstate(c, state) == fmi2OK);
    CHECK(STATELESS || ffmi2FreeFMUstate(c, &state) == fmi2OK);
    CHECK(ffmi2Terminate(c) == fmi2OK);
}

static void refuse(void *c)
{
    fmi2ValueReference reference = 0;
    double force = NAN;
    CHECK(ffmi2SetReal(c, &reference, 1, &force) == fmi2Discard);
}

#define RELEASE ffmi2FreeInstance
#endif

/* Refused calls for each instance. */
#define REFUSALS 10

/* Bytes that are allocated; Python has collected what it can. */
static double used(void)
{
    int (*hold)(void), held;
    void (*let_go)(int);
    long (*collect)(void);
    *(void **)&hold = dlsym(RTLD_DEFAULT, "PyGILState_Ensure");
    *(void **)&let_go = dlsym(RTLD_DEFAULT, "PyGILState_Release");
    *(void **)&collect = dlsym(RTLD_DEFAULT, "PyGC_Collect");
    if (hold != NULL) {
        held = hold();
        collect();
        let_go(held);
    }
    return (double)mallinfo2().uordblks;
}

static void instances(long count)
{
    for (long k = 0; k < count; k++) {
        void *c = create();
        live(c);
        RELEASE(c);
    }
}

static void refusals(void *c, long count)
{
    for (long k = 0; k < count; k++)
        refuse(c);
}

int main(int count, char **arguments)
{
    const long number = atol(arguments[count - 1]), first = 20; /* which fill caches */
    double before;
    void *c;
    start(count, arguments);
    instances(first);
    before = used();
    instances(number);
    printf("%.1f ", (used() - before) / (double)number);
    c = create();
    refusals(c, first);
    before = used();
    refusals(c, REFUSALS * number); /* many, beside which a buffer that grows once counts little */
    printf("%.1f\n", (used() - before) / (double)(REFUSALS * number));
    RELEASE(c);
    return 0;
}
