/* A co-simulation master in C: host LIBRARY GUID RESOURCES-URI SCRIPT.
 *
 * Knows FMI 2.0 and nothing of this project.  SCRIPT is `run`, `threads`, `fuzz` or `time`.
 */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"

#define CHECK(condition)                                                                            \
    do {                                                                                            \
        if (!(condition)) {                                                                         \
            fprintf(stderr, "line %d: %s does not hold\n", __LINE__, #condition);                   \
            exit(1);                                                                                \
        }                                                                                           \
    } while (0)

/* Value references of the example robot: 24 inputs, then tcp (7) and velocity (3). */
enum { FORCE_Z = 2, Q_CMD = 6, TCP = 24, INPUTS = 24, REALS = 94, STRINGS = 98 };

#define FUNCTION(name) static name##TYPE *f##name;
FUNCTION(fmi2Instantiate)
FUNCTION(fmi2FreeInstance)
FUNCTION(fmi2SetupExperiment)
FUNCTION(fmi2EnterInitializationMode)
FUNCTION(fmi2ExitInitializationMode)
FUNCTION(fmi2Terminate)
FUNCTION(fmi2Reset)
FUNCTION(fmi2GetReal)
FUNCTION(fmi2SetReal)
FUNCTION(fmi2GetString)
FUNCTION(fmi2SetString)
FUNCTION(fmi2GetInteger)
FUNCTION(fmi2SetBoolean)
FUNCTION(fmi2GetFMUstate)
FUNCTION(fmi2SetFMUstate)
FUNCTION(fmi2FreeFMUstate)
FUNCTION(fmi2SerializedFMUstateSize)
FUNCTION(fmi2SerializeFMUstate)
FUNCTION(fmi2DeSerializeFMUstate)
FUNCTION(fmi2GetDirectionalDerivative)
FUNCTION(fmi2DoStep)
FUNCTION(fmi2SetDebugLogging)

static const char *guid, *resources;
static long messages;

static void load(const char *library)
{
    void *handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (handle == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
#define LOAD(name)                                                                                  \
    *(void **)&f##name = dlsym(handle, #name);                                                      \
    CHECK(f##name != NULL);
    LOAD(fmi2Instantiate)
    LOAD(fmi2FreeInstance)
    LOAD(fmi2SetupExperiment)
    LOAD(fmi2EnterInitializationMode)
    LOAD(fmi2ExitInitializationMode)
    LOAD(fmi2Terminate)
    LOAD(fmi2Reset)
    LOAD(fmi2GetReal)
    LOAD(fmi2SetReal)
    LOAD(fmi2GetString)
    LOAD(fmi2SetString)
    LOAD(fmi2GetInteger)
    LOAD(fmi2SetBoolean)
    LOAD(fmi2GetFMUstate)
    LOAD(fmi2SetFMUstate)
    LOAD(fmi2FreeFMUstate)
    LOAD(fmi2SerializedFMUstateSize)
    LOAD(fmi2SerializeFMUstate)
    LOAD(fmi2DeSerializeFMUstate)
    LOAD(fmi2GetDirectionalDerivative)
    LOAD(fmi2DoStep)
    LOAD(fmi2SetDebugLogging)
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    (void)environment;
    CHECK(name != NULL && category != NULL && status == fmi2Error && strlen(message) > 10);
    messages++;
}

static const fmi2CallbackFunctions callbacks = {log_message, NULL, NULL, NULL, NULL};

static fmi2Component new_instance(void)
{
    fmi2Component c =
        ffmi2Instantiate("robot", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2True);
    CHECK(c != NULL);
    return c;
}

/* Steps a shaken robot and leaves the poses of all points, 7 each. */
static void shake(fmi2Component c, int steps, double size, double *poses)
{
    static const fmi2ValueReference force = FORCE_Z;
    static const double posture[6] = {0.0, -0.3, 0.5, 0.0, 0.6, 0.0};
    fmi2ValueReference drives[6], tcp[7];
    for (unsigned i = 0; i < 6; i++)
        drives[i] = Q_CMD + i;
    for (unsigned i = 0; i < 7; i++)
        tcp[i] = TCP + i;
    CHECK(ffmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(ffmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(ffmi2SetReal(c, drives, 6, posture) == fmi2OK);
    CHECK(ffmi2ExitInitializationMode(c) == fmi2OK);
    for (int k = 0; k < steps; k++) {
        double value = -500.0 * (k % 7 < 3);
        CHECK(ffmi2SetReal(c, &force, 1, &value) == fmi2OK);
        CHECK(ffmi2DoStep(c, k * size, size, fmi2True) == fmi2OK);
        CHECK(ffmi2GetReal(c, tcp, 7, poses + 7 * k) == fmi2OK);
    }
    CHECK(ffmi2Terminate(c) == fmi2OK);
}

enum { STEPS = 200 };

static void run(void)
{
    static double poses[7 * STEPS];
    fmi2Component c = new_instance();
    shake(c, STEPS, 0.004, poses);
    for (int k = 0; k < STEPS; k++)
        for (int i = 0; i < 7; i++)
            printf(i < 6 ? "%.17g," : "%.17g\n", poses[7 * k + i]);
    ffmi2FreeInstance(c);
    CHECK(messages == 0);
    CHECK(ffmi2Instantiate("robot", fmi2CoSimulation, "{other}", resources, &callbacks, fmi2False,
                           fmi2True) == NULL);
    CHECK(ffmi2Instantiate("robot", fmi2ModelExchange, guid, resources, &callbacks, fmi2False,
                           fmi2True) == NULL);
    CHECK(ffmi2Instantiate("robot", fmi2CoSimulation, guid, "http://x", &callbacks, fmi2False,
                           fmi2True) == NULL);
    CHECK(messages == 3);
}

static void *in_thread(void *poses)
{
    fmi2Component c = new_instance();
    shake(c, STEPS, 0.004, poses);
    ffmi2FreeInstance(c);
    return NULL;
}

/* Three instances, two of them in threads of their own, all at once: the same poses in all. */
static void threads(void)
{
    static double poses[3][7 * STEPS];
    pthread_t other[2];
    for (int k = 0; k < 2; k++)
        CHECK(pthread_create(&other[k], NULL, in_thread, poses[k]) == 0);
    in_thread(poses[2]);
    for (int k = 0; k < 2; k++)
        CHECK(pthread_join(other[k], NULL) == 0);
    CHECK(memcmp(poses[0], poses[1], sizeof poses[0]) == 0);
    CHECK(memcmp(poses[0], poses[2], sizeof poses[0]) == 0);
}

static unsigned long long seed = 1;

static unsigned draw(unsigned below)
{
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(seed >> 33) % below;
}

static double draw_value(void)
{
    static const double odd[] = {0.0, -1.0, 1.0, 1e300, -1e300, 1e-300, 1e7, NAN, INFINITY, -INFINITY};
    return draw(4) == 0 ? odd[draw(10)] : (draw(2000) - 1000.0) * pow(10.0, (int)draw(7) - 4);
}

/* Random calls with random arguments, in any order: a status each time, and finite outputs. */
static void fuzz(long calls)
{
    static const char *texts[] = {"linear", "backlash", "spline", "quasistatic", "dynamic", "", "%n%s",
                                  "undeflected", "no_such_file.csv"};
    fmi2Component c = new_instance();
    fmi2FMUstate state = NULL;
    double time = 0.0;
    for (long call = 0; call < calls; call++) {
        fmi2ValueReference references[8], inputs[4];
        double values[8], seeds[4];
        unsigned count = draw(8) + 1;
        for (unsigned i = 0; i < count; i++) {
            references[i] = draw(20) == 0 ? draw(200) : draw(REALS);
            values[i] = draw_value();
        }
        for (unsigned i = 0; i < 4; i++) {
            inputs[i] = draw(20) == 0 ? draw(REALS) : draw(INPUTS);
            seeds[i] = draw_value();
        }
        switch (draw(40)) {
        case 0: ffmi2SetReal(c, references, count, values); break;
        case 1: case 2: case 3: ffmi2SetReal(c, inputs, 1, seeds); break;
        case 4: case 5: case 6:
            if (ffmi2GetReal(c, references, count, values) == fmi2OK)
                for (unsigned i = 0; i < count; i++)
                    CHECK(isfinite(values[i]));
            break;
        case 7: {
            fmi2ValueReference reference = STRINGS - 4 + draw(6);
            const char *text = texts[draw(9)];
            ffmi2SetString(c, &reference, 1, &text);
            ffmi2GetString(c, &reference, 1, &text);
            break;
        }
        case 8: ffmi2SetupExperiment(c, draw(2), draw_value(), time = draw_value(), 0, 0.0); break;
        case 9: case 10: ffmi2EnterInitializationMode(c); break;
        case 11: case 12: ffmi2ExitInitializationMode(c); break;
        case 13: ffmi2GetFMUstate(c, &state); break;
        case 14: ffmi2SetFMUstate(c, state); break;
        case 15:
            if (draw(8) == 0) {
                ffmi2Reset(c);
                time = 0.0;
            }
            break;
        case 16: {
            static unsigned char bytes[100000];
            size_t size = 0;
            if (state != NULL && ffmi2SerializedFMUstateSize(c, state, &size) == fmi2OK) {
                CHECK(size <= sizeof bytes);
                ffmi2SerializeFMUstate(c, state, (fmi2Byte *)bytes, size);
                if (draw(2))
                    bytes[draw((unsigned)size)] ^= (unsigned char)draw(256);
                ffmi2DeSerializeFMUstate(c, (fmi2Byte *)bytes, size - draw(2), &state);
            }
            break;
        }
        case 17:
            ffmi2GetDirectionalDerivative(c, references, count, inputs, 2, seeds, values);
            break;
        case 18: ffmi2FreeFMUstate(c, &state); break;
        case 19: ffmi2GetInteger(c, references, draw(2), NULL); break;
        case 20: ffmi2SetBoolean(c, references, draw(2), NULL); break;
        case 21:
            if (draw(50) == 0) {
                ffmi2FreeInstance(c);
                c = new_instance();
                ffmi2FreeFMUstate(c, &state);
                time = 0.0;
            }
            break;
        default: {
            double size = draw(8) == 0 ? draw_value() : 1e-4 * draw(100);
            if (size > 1.0) /* a long step of a wild robot is no fault, but takes its time */
                size = -size;
            if (ffmi2DoStep(c, time, size, fmi2True) == fmi2OK)
                time += size;
        }
        }
    }
    ffmi2FreeFMUstate(c, &state);
    ffmi2FreeInstance(c);
    printf("%ld calls, %ld messages\n", calls, messages);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Cost of the wrench's six columns of the pose, one call each, after a step [us]. */
static double derivatives(fmi2Component c, double time, double size)
{
    static const double unit = 1.0;
    fmi2ValueReference tcp[7];
    double column[7], load[6] = {0}, start, spent = 0.0;
    static const fmi2ValueReference wrench[6] = {0, 1, 2, 3, 4, 5};
    for (unsigned i = 0; i < 7; i++)
        tcp[i] = TCP + i;
    for (int k = 0; k < 200; k++) {
        load[2] = -500.0 * (k % 70 < 30);
        ffmi2SetReal(c, wrench, 6, load);
        CHECK(ffmi2DoStep(c, time + k * size, size, fmi2True) == fmi2OK);
        start = seconds();
        for (int i = 0; i < 6; i++)
            CHECK(ffmi2GetDirectionalDerivative(c, tcp, 7, &wrench[i], 1, &unit, column) == fmi2OK);
        spent += seconds() - start;
    }
    return spent / 200;
}

/* Cost of set 6, step, get 7, of a step's six columns, and of saving and restoring a state [us], by
 * step size. */
static void measure(void)
{
    static const double sizes[] = {1e-3, 4e-3, 1e-2};
    static const fmi2ValueReference wrench[6] = {0, 1, 2, 3, 4, 5};
    fmi2ValueReference tcp[7];
    double load[6] = {0}, pose[7], best;
    for (unsigned i = 0; i < 7; i++)
        tcp[i] = TCP + i;
    for (int s = 0; s < 3; s++) {
        double scratch[7];
        best = INFINITY;
        for (int trial = 0; trial < 100; trial++) {
            fmi2Component c = new_instance();
            double start;
            shake(c, 1, sizes[s], scratch);
            start = seconds();
            for (int k = 1; k <= 500; k++) {
                load[2] = -500.0 * (k % 70 < 30);
                ffmi2SetReal(c, wrench, 6, load);
                CHECK(ffmi2DoStep(c, k * sizes[s], sizes[s], fmi2True) == fmi2OK);
                ffmi2GetReal(c, tcp, 7, pose);
            }
            best = fmin(best, (seconds() - start) / 500);
            ffmi2FreeInstance(c);
        }
        printf("step %g %.3f\n", sizes[s], 1e6 * best);
        best = INFINITY;
        for (int trial = 0; trial < 100; trial++) {
            fmi2Component c = new_instance();
            shake(c, 1, sizes[s], scratch);
            best = fmin(best, derivatives(c, sizes[s], sizes[s]));
            ffmi2FreeInstance(c);
        }
        printf("columns %g %.3f\n", sizes[s], 1e6 * best);
    }
    {
        fmi2Component c = new_instance();
        fmi2FMUstate state = NULL;
        double start;
        shake(c, 1, 1e-3, pose);
        best = INFINITY;
        for (int trial = 0; trial < 100; trial++) {
            start = seconds();
            for (int k = 0; k < 1000; k++) {
                ffmi2GetFMUstate(c, &state);
                ffmi2SetFMUstate(c, state);
            }
            best = fmin(best, (seconds() - start) / 1000);
        }
        printf("state 0 %.3f\n", 1e6 * best);
        ffmi2FreeFMUstate(c, &state);
        ffmi2FreeInstance(c);
    }
}

int main(int count, char **arguments)
{
    CHECK(count >= 5);
    guid = arguments[2];
    resources = arguments[3];
    load(arguments[1]);
    if (strcmp(arguments[4], "run") == 0)
        run();
    else if (strcmp(arguments[4], "threads") == 0)
        threads();
    else if (strcmp(arguments[4], "fuzz") == 0)
        fuzz(atol(arguments[5]));
    else
        measure();
    return 0;
}
