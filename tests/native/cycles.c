/* A controller's cycle: cycles LIBRARY GUID RESOURCES-URI SCRIPT; SCRIPT is `allocations`, which prints how often
 * memory was asked for by each kind of call, or PERIOD,STEPS,DRIVE, which prints the time of each cycle
 * [ns]: median, 99.9 %, largest, and the mean of all but the longest 0.1 %. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <time.h>

#include "master.h"

/* glibc's own; those below take their place in this process, the library's calls among them. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *block, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

static long asked;

void *malloc(size_t size)
{
    asked++;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    asked++;
    return __libc_calloc(count, size);
}

void *realloc(void *block, size_t size)
{
    asked++;
    return __libc_realloc(block, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    asked++;
    return __libc_memalign(alignment, size);
}

int posix_memalign(void **block, size_t alignment, size_t size)
{
    asked++;
    *block = __libc_memalign(alignment, size);
    return *block == NULL;
}

enum { MOST = 400, JOINTS = 6, INPUTS = 6 + 3 * JOINTS, OUTPUTS = 7 };
static const double pi = 3.14159265358979323846;
static fmi2ValueReference input[MOST], output[MOST];
static size_t inputs, outputs;

static fmi2ValueReference reference_of(const char *name)
{
    for (unsigned k = 0; k < variable_count; k++)
        if (strcmp(variables[k].name, name) == 0)
            return variables[k].reference;
    fprintf(stderr, "there is no variable %s\n", name);
    exit(1);
}

/* Real variables of a causality, in the order of the description. */
static size_t all_of(const char *causality, fmi2ValueReference *references)
{
    size_t count = 0;
    for (unsigned k = 0; k < variable_count; k++)
        if (!variables[k].is_string && strcmp(variables[k].causality, causality) == 0)
            references[count++] = variables[k].reference;
    return count;
}

static void set_string(fmi2Component c, const char *name, const char *value)
{
    fmi2ValueReference reference = reference_of(name);
    CHECK(ffmi2SetString(c, &reference, 1, &value) == fmi2OK);
}

/* A force that comes and goes, and all drives in motion: 0.2 rad at 0.8 Hz about the posture. */
static void find_inputs(double time, double values[INPUTS])
{
    static const double posture[JOINTS] = {0.0, -0.3, 0.5, 0.0, 0.6, 0.0};
    double omega = 2.0 * pi * 0.8;
    memset(values, 0, INPUTS * sizeof *values);
    values[2] = fmod(time, 0.28) < 0.12 ? -500.0 : 0.0;
    for (int i = 0; i < JOINTS; i++) {
        double phase = omega * time + i;
        values[6 + i] = posture[i] + 0.2 * (sin(phase) - sin(i));
        values[6 + JOINTS + i] = 0.2 * omega * cos(phase);
        values[6 + 2 * JOINTS + i] = -0.2 * omega * omega * sin(phase);
    }
}

static fmi2Component start(const char *curve, const char *mode, const char *drive)
{
    double values[INPUTS];
    fmi2Component c = new_instance();
    set_string(c, "torque_curve", curve);
    set_string(c, "mode", mode);
    set_string(c, "drive", drive);
    CHECK(ffmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(ffmi2EnterInitializationMode(c) == fmi2OK);
    find_inputs(0.0, values);
    CHECK(ffmi2SetReal(c, input, INPUTS, values) == fmi2OK);
    CHECK(ffmi2ExitInitializationMode(c) == fmi2OK);
    return c;
}

/* How often each kind of call asks for memory, of `steps` steps. */
static void count_calls(const char *curve, const char *mode, int steps)
{
    static const double unit = 1.0;
    double values[INPUTS], all[MOST], column[MOST];
    long before = asked, set = 0, step = 0, get = 0, derivative = 0, state = 0;
    fmi2Component c = start(curve, mode, "ideal");
    fmi2FMUstate saved = NULL;
    CHECK(ffmi2GetFMUstate(c, &saved) == fmi2OK);
    printf("%s,%s: start %ld", curve, mode, asked - before);
    for (int k = 0; k < steps; k++) {
        before = asked;
        find_inputs(k * 1e-3, values);
        CHECK(ffmi2SetReal(c, input, INPUTS, values) == fmi2OK);
        set += asked - before, before = asked;
        CHECK(ffmi2DoStep(c, k * 1e-3, 1e-3, fmi2True) == fmi2OK);
        CHECK(ffmi2DoStep(c, k * 1e-3, 1e-3, fmi2True) == fmi2Error); /* refused: elsewhere */
        step += asked - before, before = asked;
        CHECK(ffmi2GetReal(c, output, outputs, all) == fmi2OK);
        get += asked - before, before = asked;
        for (size_t j = 0; j < inputs && k % 10 == 0; j++)
            CHECK(ffmi2GetDirectionalDerivative(c, output, outputs, &input[j], 1, &unit, column) ==
                  fmi2OK);
        derivative += asked - before, before = asked;
        CHECK(ffmi2GetFMUstate(c, &saved) == fmi2OK && ffmi2SetFMUstate(c, saved) == fmi2OK);
        state += asked - before;
    }
    printf(", set %ld, step %ld, get %ld, derivative %ld, state %ld\n", set, step, get, derivative,
           state);
    ffmi2FreeFMUstate(c, &saved);
    ffmi2FreeInstance(c);
}

static double nanoseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    const float *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* Cycles of set, step, get as fast as they go. */
static void time_cycles(double period, size_t steps, const char *drive)
{
    float *wall = malloc(steps * sizeof *wall);
    double values[INPUTS], pose[OUTPUTS], sum = 0.0;
    fmi2Component c = start("backlash", "dynamic", drive);
    CHECK(wall != NULL);
    memset(wall, 0, steps * sizeof *wall);
    for (size_t k = 0; k < steps; k++) {
        double begin;
        find_inputs((double)k * period, values);
        begin = nanoseconds();
        CHECK(ffmi2SetReal(c, input, INPUTS, values) == fmi2OK);
        CHECK(ffmi2DoStep(c, (double)k * period, period, fmi2True) == fmi2OK);
        CHECK(ffmi2GetReal(c, output, OUTPUTS, pose) == fmi2OK);
        wall[k] = (float)(nanoseconds() - begin);
    }
    ffmi2FreeInstance(c);
    qsort(wall, steps, sizeof *wall, by_size);
    for (size_t k = 0; k < (steps * 999) / 1000; k++)
        sum += wall[k];
    printf("%.0f %.0f %.0f %.0f\n", wall[steps / 2], wall[(steps * 999) / 1000], wall[steps - 1],
           sum / (double)((steps * 999) / 1000));
    free(wall);
}

int main(int count, char **arguments)
{
    double period;
    unsigned long steps;
    char drive[16];
    start_master(count, arguments);
    inputs = all_of("input", input);
    outputs = all_of("output", output);
    CHECK(inputs >= INPUTS && input[0] == reference_of("force.x") &&
          input[6] == reference_of("q_cmd[1]") && output[0] == reference_of("tcp.x"));
    if (sscanf(arguments[4], "%lf,%lu,%15s", &period, &steps, drive) == 3) {
        time_cycles(period, steps, drive);
    } else {
        static const char *const curves[] = {"linear", "backlash", "spline"};
        for (int k = 0; k < 3; k++) {
            count_calls(curves[k], "dynamic", 200);
            count_calls(curves[k], "quasistatic", 50);
        }
    }
    return 0;
}
