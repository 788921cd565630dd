/* A co-simulation master in C: host LIBRARY GUID RESOURCES-URI SCRIPT; SCRIPT is `run`, `threads` or `time`. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <time.h>

#include "master.h"

static fmi2ValueReference wrench[6], drives[6], tcp[7], anchor[12];

static unsigned reference_of(const char *name)
{
    for (unsigned k = 0; k < variable_count; k++)
        if (strcmp(variables[k].name, name) == 0)
            return variables[k].reference;
    fprintf(stderr, "there is no variable %s\n", name);
    exit(1);
}

static void find_variables(void)
{
    static const char *const loads[] = {"force.x",  "force.y",  "force.z",
                                        "moment.x", "moment.y", "moment.z"};
    static const char *const pose[] = {"tcp.x",  "tcp.y",  "tcp.z", "tcp.qx",
                                       "tcp.qy", "tcp.qz", "tcp.qw"};
    for (int i = 0; i < 7; i++)
        tcp[i] = reference_of(pose[i]);
    for (unsigned i = 0; i < 12; i++) /* position, velocity, stiffness */
        anchor[i] = reference_of("anchor.x") + i;
    for (int i = 0; i < 6; i++) {
        char name[24];
        snprintf(name, sizeof name, "q_cmd[%d]", i + 1);
        drives[i] = reference_of(name);
        wrench[i] = reference_of(loads[i]);
    }
}

/* Steps a shaken robot and leaves the poses of all points, 7 each. */
static void shake(fmi2Component c, int steps, double size, double *poses)
{
    static const double posture[6] = {0.0, -0.3, 0.5, 0.0, 0.6, 0.0};
    CHECK(ffmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(ffmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(ffmi2SetReal(c, drives, 6, posture) == fmi2OK);
    CHECK(ffmi2ExitInitializationMode(c) == fmi2OK);
    for (int k = 0; k < steps; k++) {
        double value = -500.0 * (k % 7 < 3);
        CHECK(ffmi2SetReal(c, &wrench[2], 1, &value) == fmi2OK);
        CHECK(ffmi2DoStep(c, k * size, size, fmi2True) == fmi2OK);
        CHECK(ffmi2GetReal(c, tcp, 7, poses + 7 * k) == fmi2OK);
    }
}

enum { STEPS = 100 };

static void run(void)
{
    static double poses[7 * STEPS];
    fmi2Component c = new_instance();
    shake(c, STEPS, 0.004, poses);
    for (int k = 0; k < STEPS; k++)
        for (int i = 0; i < 7; i++)
            printf(i < 6 ? "%.17g," : "%.17g\n", poses[7 * k + i]);
    CHECK(ffmi2Terminate(c) == fmi2OK);
    ffmi2FreeInstance(c);
    CHECK(messages == 0);
    CHECK(ffmi2Instantiate("robot", fmi2CoSimulation, "{other}", resources, &callbacks, fmi2False,
                           fmi2True) == NULL);
    CHECK(ffmi2Instantiate("robot", fmi2CoSimulation, guid, "http://x", &callbacks, fmi2False,
                           fmi2True) == NULL);
    CHECK(messages == 2);
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
    double column[7], load[6] = {0}, start, spent = 0.0;
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

/* Cost of set 6, step, get 7 [us]; on a spring of some 1e6 N/m set 12 more, its stiffness changes. */
static double stepping(double size, bool sprung)
{
    double load[6] = {0}, spring[12] = {0}, pose[7], best = INFINITY;
    for (int trial = 0; trial < 100; trial++) {
        fmi2Component c = new_instance();
        double start;
        shake(c, 1, size, pose);
        memcpy(spring, pose, 3 * sizeof *spring);
        start = seconds();
        for (int k = 1; k <= 500; k++) {
            load[2] = -500.0 * (k % 70 < 30);
            ffmi2SetReal(c, wrench, 6, load);
            if (sprung) {
                spring[6] = spring[9] = spring[11] = 1e6 + 1e3 * (k % 70);
                ffmi2SetReal(c, anchor, 12, spring);
            }
            CHECK(ffmi2DoStep(c, k * size, size, fmi2True) == fmi2OK);
            ffmi2GetReal(c, tcp, 7, pose);
        }
        best = fmin(best, (seconds() - start) / 500);
        ffmi2FreeInstance(c);
    }
    return 1e6 * best;
}

/* Cost of a step, of one on a spring, of a step's six columns, and of saving and restoring a state [us],
 * by step size. */
static void measure(void)
{
    static const double sizes[] = {1e-3, 4e-3, 1e-2};
    double pose[7], best;
    for (int s = 0; s < 3; s++) {
        double scratch[7];
        printf("step %g %.3f\n", sizes[s], stepping(sizes[s], false));
        printf("spring %g %.3f\n", sizes[s], stepping(sizes[s], true));
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
    start_master(count, arguments);
    find_variables();
    if (strcmp(arguments[4], "run") == 0)
        run();
    else if (strcmp(arguments[4], "threads") == 0)
        threads();
    else
        measure();
    return 0;
}
