/* Random numbers for the desk library: fuzz_desk ROUNDS SEED ROBOT.TXT..
 *
 * Every array has its own size and not a number more, so that a sanitizer sees what is read beside it.
 */
#include "draw.h"

#include "fmi/fmi2FunctionTypes.h"
#include "fmi/fmi3FunctionTypes.h"

#include "../../coupling/native/desk/drive_fit.h"
#include "../../coupling/native/desk/elements.h"
#include "../../coupling/native/desk/fmi_steps.h"
#include "../../coupling/native/desk/gear_path.h"
#include "../../coupling/native/desk/link_path.h"
#include "../../coupling/native/desk/reach.h"
#include "../../coupling/native/desk/rest.h"
#include "../../coupling/native/desk/smooth_wrench.h"
#include "../../coupling/native/desk/spline.h"

static double *draw_numbers(size_t count, bool wild)
{
    double *numbers = malloc(count * sizeof *numbers + (count == 0));
    CHECK(numbers != NULL);
    for (size_t k = 0; k < count; k++)
        numbers[k] = wild ? draw_value() : 1e-3 * (draw(2001) - 1000.0);
    return numbers;
}

static void draw_rows(const er_desk *desk, bool wild)
{
    size_t n = desk->robot.angles, m = desk->robot.elastics, count = 1 + draw(9);
    double *theta = draw_numbers(count * n, wild), *rate = draw_numbers(count * n, wild);
    double *acceleration = draw_numbers(count * n, wild), *wrench = draw_numbers(count * 6, wild);
    double *load = draw_numbers(count * n, false), *by = draw_numbers(count * 3 * n * n, false);
    double *jacobian = draw_numbers(count * 6 * n, false), *position = draw_numbers(count * 3, false);
    double *rotation = draw_numbers(count * 9, false), *mass = draw_numbers(count * m * m, false);
    er_desk_loads(desk, count, theta, rate, acceleration, wrench, load);
    er_desk_linearise(desk, count, theta, rate, acceleration, wrench, load, by, jacobian, position, rotation);
    er_desk_place(desk, count, theta, position, rotation);
    er_desk_masses(desk, count, theta, mass);
    free(theta), free(rate), free(acceleration), free(wrench), free(load), free(by);
    free(jacobian), free(position), free(rotation), free(mass);
}

/* Whether an iteration was solved. */
static bool draw_iteration(const er_desk *desk, bool wild)
{
    size_t n = desk->robot.angles, intervals = 1 + draw(120), edge = draw(11), conditions = draw(40);
    er_link_report report;
    er_link_task task = {.intervals = (int64_t)intervals, .conditions = (int64_t)conditions};
    int64_t *first = malloc((conditions + 1) * sizeof *first), *angle = malloc((conditions + 1) * sizeof *angle);
    er_link_iterations *links = er_link_iterations_create(desk, 6 + draw(40));
    double *numbers[11], *coefficients = draw_numbers((intervals + 5) * n, wild);
    double *step = draw_numbers((intervals + 5) * n, false);
    size_t sizes[] = {36, 3 * (intervals + 1), 4 * (intervals + 1), 6 * (intervals + 1), 0, 0, 0,
                      (intervals + 5) * desk->robot.joints, desk->tilts.count, 5 * conditions, conditions};
    const double **arrays[] = {&task.weights, &task.position, &task.quaternion, &task.wrench, &task.middle_position,
                               &task.middle_quaternion, &task.middle_wrench, &task.rigid, &task.balance,
                               &task.condition_weights, &task.condition_target};
    bool solved;
    CHECK(links != NULL && first != NULL && angle != NULL);
    if (2 * edge > intervals)
        edge = intervals / 2;
    task.edge = (int64_t)edge;
    sizes[4] = 6 * edge, sizes[5] = 8 * edge, sizes[6] = 12 * edge;
    for (int k = 0; k < 11; k++)
        *arrays[k] = numbers[k] = draw_numbers(sizes[k], wild && draw(3) == 0);
    for (size_t c = 0; c < conditions; c++) {
        first[c] = draw(2) ? 0 : task.intervals;
        angle[c] = draw((unsigned)n);
    }
    task.condition_first = first;
    task.condition_angle = angle;
    task.position_weight = task.rotation_weight = 1e3;
    task.acceleration_weight = task.tether = 1.0;
    solved = er_link_iterations_improve(links, &task, coefficients, draw(2) ? 0.0 : 1e-9, step, &report);
    er_link_iterations_free(links);
    for (int k = 0; k < 11; k++)
        free(numbers[k]);
    free(first), free(angle), free(coefficients), free(step);
    return solved;
}

/* A drive and its fit. */
static void draw_elements(const er_gear_drive *drive, const double *wind_up, bool wild)
{
    size_t count = 1 + draw(6), steps = (size_t)(drive->count * drive->parts);
    double *slip_torque = draw_numbers(count, wild), *slip_angle = draw_numbers(count, wild);
    double *start = draw_numbers(count, wild), *impulse = draw_numbers(2 * steps, false);
    double *slope = draw_numbers(10 * steps, false), *elongation = draw_numbers(steps * count, false);
    double *room = draw_numbers(2 * count, false), *along = draw_numbers(5 * steps * count, false);
    er_gear_elements elements = {(int64_t)count, slip_torque, slip_angle};
    er_elements_hold(drive, &elements, wind_up, start, impulse, slope, elongation, room);
    er_elements_along(&elements, 5 * (int64_t)steps, wind_up, start, along);
    free(slip_torque), free(slip_angle), free(start), free(impulse), free(slope), free(elongation), free(room);
    free(along);
}

static void draw_drive(bool wild)
{
    size_t count = 3 + draw(20), parts = 1 + draw(9), degree = draw(2) ? 3 : 5, pieces = 1 + draw(6), sines = draw(4);
    size_t conditions = draw(6), steps = count * parts, size = (count + degree + 1) * (parts + 1);
    er_drive_fit fit = {.drive = {.count = (int64_t)count, .parts = (int64_t)parts, .degree = (int64_t)degree,
                                  .first = draw(2), .pieces = (int64_t)pieces, .sines = (int64_t)sines,
                                  .step = 1e-3, .damping = draw_value(), .link_rate = draw_value()},
                        .cycle = 1e-3 * (double)parts, .smoothing = 1e-8, .heavy = 1e4, .counted = 1e2,
                        .idle = 1e-7, .conditions = (int64_t)conditions};
    er_gear_drive *drive = &fit.drive;
    bool held = draw(2);
    const double **arrays[] = {&drive->knots, &drive->origins, &drive->cubics, &drive->amplitude, &drive->order,
                               &drive->phase, &drive->value, &drive->start_row, &drive->fine, &drive->link,
                               &drive->impulse, &drive->inertia, &drive->scale, &fit.bend, &fit.condition_weights,
                               &fit.condition_value, &drive->held_wind_up, &drive->held_impulse, &drive->held_slope};
    const size_t sizes[] = {pieces - 1, pieces, 4 * pieces, sines, sines, sines, 5 * parts * (degree + 1), degree + 1,
                            160, 4 * steps + 1, 2 * steps, steps, steps, count + degree - 2, conditions * (degree + 1),
                            conditions, 5 * steps, 2 * steps, 10 * steps};
    double *numbers[19], *coefficients = draw_numbers(count + degree, wild), *misses = draw_numbers(steps + 1, wild);
    double *step = draw_numbers(size, false), *wind_up = draw_numbers(5 * steps, false);
    double *defects = draw_numbers(steps, false), *rows = draw_numbers(steps * (degree + 5), false);
    er_stretch stretches[8];
    int64_t end = 0, some = 0;
    int64_t *first = malloc((conditions + 1) * sizeof *first);
    int count_of_arrays = held ? 19 : 16;
    CHECK(first != NULL);
    for (int k = 0; k < count_of_arrays; k++)
        *arrays[k] = numbers[k] = draw_numbers(sizes[k], wild && draw(3) == 0);
    for (; end < (int64_t)count && some < 8; some++) {
        stretches[some].begin = draw(2) ? end : end + draw((unsigned)(count - end));
        stretches[some].end = end = stretches[some].begin + 1 + draw((unsigned)(count - stretches[some].begin));
    }
    for (size_t c = 0; c < conditions; c++)
        first[c] = draw((unsigned)count);
    fit.condition_first = first;
    er_gear_wind_ups(drive, coefficients, misses, wind_up);
    er_gear_defects(drive, coefficients, misses, defects);
    er_gear_rows(drive, coefficients, misses, rows);
    draw_elements(drive, wind_up, wild);
    er_drive_fit_value(&fit, some, stretches, coefficients, misses);
    er_drive_fit_step(&fit, some, stretches, coefficients, misses, draw_input(), 1 + draw(9), step);
    for (int k = 0; k < count_of_arrays; k++)
        free(numbers[k]);
    free(coefficients), free(misses), free(step), free(wind_up), free(defects), free(rows), free(first);
}

/* A spline at any times; its coefficients may be not a number. */
static void draw_spline(bool wild)
{
    size_t degree = draw(6), terms = 1 + draw((unsigned)degree + 1), intervals = 1 + draw(9), quantities = draw(5);
    size_t count = draw(40);
    double *coefficients = draw_numbers((intervals + degree) * quantities, wild);
    double *powers = draw_numbers(terms * (degree + 1), wild), *times = draw_numbers(count, wild);
    double *values = draw_numbers(count * quantities, false);
    er_spline spline = {(int64_t)degree, (int64_t)intervals, (int64_t)quantities, draw_input(), draw_input(), coefficients};
    er_spline_at(&spline, (int64_t)terms, powers, (int64_t)count, times, values);
    free(coefficients), free(powers), free(times), free(values);
}

static void draw_wrench(bool wild)
{
    size_t count = 2 + draw(30), at = draw(60);
    double *instants = draw_numbers(count, wild), *before = draw_numbers(6 * count, wild);
    double *behind = draw_numbers(6 * count, wild), *times = draw_numbers(at, wild), *wrench = draw_numbers(6 * at, false);
    er_wrench_history history = {(int64_t)count, draw(2) ? 1e-3 : draw_value(), instants, before, behind};
    for (size_t k = 1; k < count && draw(8); k++)
        instants[k] = instants[k - 1] + 0.01 * draw(100);
    er_smooth_wrench(&history, (int64_t)at, times, wrench);
    free(instants), free(before), free(behind), free(times), free(wrench);
}

static void draw_gear(bool wild)
{
    size_t corners = 1 + draw(9), count = 1 + draw(200), elements = draw(4), room = corners + 2 * elements, series = draw(4);
    double *angle = draw_numbers(corners, wild), *torque = draw_numbers(corners, wild);
    double *slope = draw_numbers(corners + 1, wild), *slip_torque = draw_numbers(elements, wild);
    double *slip_angle = draw_numbers(elements, wild), *elongation = draw_numbers(elements, wild);
    double *pulls = draw_numbers(count, wild), *path = draw_numbers(count, false), *rate = draw_numbers(count, false);
    double *angles = draw_numbers(room, false), *torques = draw_numbers(room, false);
    double *slopes = draw_numbers(room + 1, false), *rows = draw_numbers(series * count, wild);
    double *backlash = draw_numbers(series, wild), *damping = draw_numbers(series, wild);
    int64_t *changes = malloc((series + 1) * sizeof *changes), found;
    er_gear_law law = {(int64_t)corners, angle, torque, slope};
    er_gear_elements slips = {(int64_t)elements, slip_torque, slip_angle};
    CHECK(changes != NULL);
    for (size_t k = 1; k < corners && !wild; k++)
        angle[k] = angle[k - 1] + 1e-3 * (1 + draw(9));
    found = er_gear_law_with_elements(&law, &slips, draw_value(), elongation, angles, torques, slopes);
    CHECK(found >= 1 && found <= (int64_t)room);
    CHECK(er_gear_path(&law, &slips, draw(2) ? 1.0 : draw_value(), 1e-3, (int64_t)count, pulls, draw_value(), path, rate));
    er_backlash_reversals((int64_t)count, (int64_t)series, 1e-3, rows, backlash, damping, changes);
    free(angle), free(torque), free(slope), free(slip_torque), free(slip_angle), free(elongation), free(pulls), free(path);
    free(rate), free(angles), free(torques), free(slopes), free(rows), free(backlash), free(damping), free(changes);
}

static void draw_reach(const er_desk *desk, bool wild)
{
    size_t count = 1 + draw(5);
    double *position = draw_numbers(3 * count, wild), *quaternion = draw_numbers(4 * count, wild);
    double *theta = draw_numbers(count * desk->robot.angles, wild), *error = draw_numbers(count, false);
    double *away = draw_numbers(count, false);
    er_reach_rules rules = {1e-9, draw(40), draw(2) ? 1e-3 : draw_value(), draw(2) ? 1e-12 : draw_value(), 0.3};
    er_desk_reach(desk, &rules, (int64_t)count, position, quaternion, theta, error, away);
    free(position), free(quaternion), free(theta), free(error), free(away);
}

static void draw_rest(const er_desk *desk, bool wild)
{
    double *q = draw_numbers((size_t)desk->robot.joints, wild), *wrench = draw_numbers(6, wild);
    double *x = draw_numbers((size_t)desk->robot.elastics, false);
    er_desk_rest(desk, (int64_t)draw(5) - 1, q, wrench, x);
    free(q), free(wrench), free(x);
}

/* What an FMU might answer: now and then Discard, Error or Fatal. */
static fmi2Status some_status(void)
{
    return draw(40) == 0 ? fmi2Discard + draw(3) : (fmi2Status)draw(2);
}

/* References count the values of each variable here. */
static void read_values(const uint32_t *reference, size_t references, const double *values)
{
    for (size_t k = 0; k < references; k++)
        for (uint32_t j = 0; j < reference[k]; j++)
            CHECK(*values++ == 1.0);
}

static void fill_values(const uint32_t *reference, size_t references, double *values)
{
    for (size_t k = 0; k < references; k++)
        for (uint32_t j = 0; j < reference[k]; j++)
            *values++ = 2.0;
}

static fmi2Status set2(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    CHECK(c != NULL);
    read_values(vr, nvr, value);
    return some_status();
}

static fmi2Status step2(fmi2Component c, fmi2Real start, fmi2Real size, fmi2Boolean no_return)
{
    CHECK(c != NULL && start >= 0.0 && size == 0.5 && no_return);
    return some_status();
}

static fmi2Status get2(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    CHECK(c != NULL);
    fill_values(vr, nvr, value);
    return some_status();
}

static fmi3Status set3(fmi3Instance i, const fmi3ValueReference vr[], size_t nvr, const fmi3Float64 value[], size_t n)
{
    CHECK(i != NULL && (nvr == 0 || n > 0));
    read_values(vr, nvr, value);
    return (fmi3Status)some_status();
}

static fmi3Status step3(fmi3Instance i, fmi3Float64 start, fmi3Float64 size, fmi3Boolean no_return, fmi3Boolean *event,
                        fmi3Boolean *ended, fmi3Boolean *early, fmi3Float64 *reached)
{
    CHECK(i != NULL && start >= 0.0 && size == 0.5 && no_return);
    *event = draw(2) == 0, *ended = draw(40) == 0, *early = draw(60) == 0, *reached = start + size;
    return (fmi3Status)some_status();
}

static fmi3Status get3(fmi3Instance i, const fmi3ValueReference vr[], size_t nvr, fmi3Float64 value[], size_t n)
{
    CHECK(i != NULL && (nvr == 0 || n > 0));
    fill_values(vr, nvr, value);
    return (fmi3Status)some_status();
}

static er_series draw_series(uint32_t *reference)
{
    er_series series = {reference, draw(5), 0};
    for (uint64_t k = 0; k < series.references; k++)
        series.width += reference[k] = 1 + draw(3);
    return series;
}

static void draw_steps(void)
{
    size_t count = draw(30);
    uint32_t in[5], out[5];
    bool third = draw(2) == 0;
    er_steps steps = {.instance = &steps, .inputs = draw_series(in), .outputs = draw_series(out)};
    double *time = draw_numbers(count + 1, false), *rows = draw_numbers(count * steps.inputs.width, false);
    double *answers = draw_numbers(count * steps.outputs.width, false);
    int64_t end;
    for (size_t k = 0; k <= count; k++)
        time[k] = 0.5 * (double)k;
    for (size_t k = 0; k < count * steps.inputs.width; k++)
        rows[k] = 1.0;
    steps.set = third ? (void (*)(void))set3 : (void (*)(void))set2;
    steps.step = third ? (void (*)(void))step3 : (void (*)(void))step2;
    steps.get = third ? (void (*)(void))get3 : (void (*)(void))get2;
    end = (third ? er_fmi3_steps : er_fmi2_steps)(&steps, (int64_t)count, time, rows, answers);
    CHECK(end == ER_STEPS_DONE || (steps.number >= 0 && steps.number < (int64_t)count));
    CHECK((steps.status > fmi2Warning) == (end == ER_STEPS_SET || end == ER_STEPS_STEP || end == ER_STEPS_GET));
    for (size_t k = 0; end == ER_STEPS_DONE && k < count * steps.outputs.width; k++)
        CHECK(answers[k] == 2.0);
    free(time), free(rows), free(answers);
}

int main(int count, char **arguments)
{
    int solved = 0, rounds = atoi(arguments[1]);
    start_draw(count, arguments, 2);
    for (int k = 0; k < rounds; k++) {
        char message[ER_MESSAGE];
        er_failure failure;
        size_t size;
        char *text = er_read_file(arguments[3 + draw((unsigned)count - 3)], &size, &failure);
        er_desk *(*create)(const char *, char *) = draw(2) ? er_desk_create : er_desk_create_plain;
        CHECK(text != NULL);
        if (draw(8) == 0)
            text[draw((unsigned)size)] = '\0';
        er_desk *desk = create(text, message);
        free(text);
        if (desk == NULL) {
            CHECK(message[0] != '\0');
            continue;
        }
        bool wild = draw(2) == 0;
        draw_rows(desk, wild);
        draw_reach(desk, wild);
        draw_rest(desk, wild);
        draw_drive(wild);
        draw_spline(wild);
        draw_wrench(wild);
        draw_gear(wild);
        draw_steps();
        solved += draw_iteration(desk, wild);
        er_desk_free(desk);
    }
    printf("%d solved\n", solved);
    return 0;
}
