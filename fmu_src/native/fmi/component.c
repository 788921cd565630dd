#include "component.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "log_categories.h"
#include "exchange.h"
#include "variables.h"

static void send_to_log(const er_component *c, unsigned category, const char *text)
{
    int status = category == ER_LOG_EVENTS    ? ER_OK
                 : category == ER_LOG_WARNING ? ER_WARNING
                 : category == ER_LOG_DISCARD ? ER_DISCARD
                                              : ER_ERROR;
    c->log.tell(c, status, er_log_name(category), text);
}

/* Tells the master's log, where it is on for that; false where it is not. */
static bool tell_log(const er_component *c, unsigned category, const char *text)
{
    if ((c->log.categories & category) == 0 || c->log.function == NULL)
        return false;
    send_to_log(c, category, text);
    return true;
}

/* Without the master's log, stderr. */
static void tell_log_or_stderr(const er_component *c, unsigned category, const char *text)
{
    if (!tell_log(c, category, text)) {
        fprintf(stderr, "%s: %s\n", c->name, text);
        fflush(stderr);
    }
}

er_component *er_component_create(const char *name, er_log log, er_instance *robot, const er_failure *failure)
{
    size_t length = name != NULL ? strlen(name) : 0;
    er_component *c = calloc(1, sizeof *c + length + 1);
    if (c == NULL) {
        er_instance_free(robot);
        return NULL;
    }
    if (length > 0)
        memcpy(c->name, name, length);
    c->log = log;
    c->robot = robot;
    if (robot != NULL)
        return c;
    tell_log_or_stderr(c, ER_LOG_ERROR, failure->text);
    /* The master's log is told in any case: fmi2Instantiate and fmi3Instantiate.. ask for it. */
    if (log.function != NULL && (log.categories & ER_LOG_ERROR) == 0)
        send_to_log(c, ER_LOG_ERROR, failure->text);
    er_component_free(c);
    return NULL;
}

void er_component_free(er_component *c)
{
    if (c == NULL)
        return;
    er_instance_free(c->robot);
    free(c);
}

bool er_component_refuse(er_component *c, const char *text)
{
    if (c == NULL)
        return false;
    c->discards = false;
    tell_log_or_stderr(c, ER_LOG_ERROR, text);
    return false;
}

/* What an instance took, although something is wrong with it. */
static void pass_warning_on(er_component *c)
{
    c->warns = c->robot->warned;
    if (c->warns)
        tell_log(c, ER_LOG_WARNING, c->robot->failure.text);
}

void er_component_discard(er_component *c, const char *text)
{
    tell_log(c, ER_LOG_DISCARD, text);
}

bool er_component_told(er_component *c, bool good)
{
    return good || er_component_refuse(c, c->robot->failure.text);
}

bool er_component_tried(er_component *c, bool good)
{
    if (good)
        return true;
    c->discards = c->robot->failure.may_retry;
    tell_log_or_stderr(c, c->discards ? ER_LOG_DISCARD : ER_LOG_ERROR, c->robot->failure.text);
    return false;
}

bool er_component_may(er_component *c, er_call call)
{
    const char *refusal = c == NULL ? NULL : er_refusal(c->robot->progress.phase, call);
    return c != NULL && (refusal == NULL || er_component_refuse(c, refusal));
}

bool er_component_given(er_component *c, size_t count, const void *first, const void *second)
{
    return count == 0 || (first != NULL && second != NULL) ||
           er_component_refuse(c, "expected the address of every array and result, got NULL");
}

bool er_component_log(er_component *c, bool on, bool others_stay, const char *const *categories, size_t count)
{
    unsigned chosen, others;
    if (!er_component_may(c, ER_CALL_ANY))
        return false;
    if (!er_log_chosen(categories, count, &chosen))
        return er_component_refuse(c, ER_LOG_REFUSAL);
    others = others_stay ? c->log.categories & ~chosen : 0;
    c->log.categories = others | (on ? chosen : 0);
    return true;
}

bool er_component_setup(er_component *c, double start, double stop, double tolerance)
{
    return er_component_may(c, ER_CALL_SETUP) &&
           er_component_told(c, er_instance_setup(c->robot, start, stop, tolerance));
}

static bool enter_phase(er_component *c, er_call call, er_phase phase)
{
    if (!er_component_may(c, call))
        return false;
    c->robot->progress.phase = phase;
    return true;
}

bool er_component_enter(er_component *c)
{
    return enter_phase(c, ER_CALL_ENTER, ER_INITIALISING);
}

static const char *chosen_option(er_instance *robot, int string)
{
    const char *text;
    er_instance_get_string(robot, (unsigned)(robot->interface.reals + string), &text);
    return text;
}

bool er_component_exit(er_component *c)
{
    er_instance *robot;
    er_failure text;
    bool changed; /* what the master has not read yet */
    char number[ER_NUMBER_TEXT], error[ER_NUMBER_TEXT];
    if (!er_component_may(c, ER_CALL_EXIT) || !er_component_told(c, er_instance_start(c->robot) &&
                                  (!c->robot->exchange.on || er_exchange_settle(c->robot, &changed))))
        return false;
    pass_warning_on(c);
    robot = c->robot;
    er_fail(&text, "starts at %s s: %s, from %s, torque curve %s; tolerance %s m at the TCP",
            er_shown(robot->progress.time, number), chosen_option(robot, ER_MODE), chosen_option(robot, ER_INITIAL_STATE),
            chosen_option(robot, ER_TORQUE_CURVE), er_shown(robot->model->memory.options.tolerance, error));
    tell_log(c, ER_LOG_EVENTS, text.text);
    return true;
}

bool er_component_step(er_component *c, double start, double size)
{
    if (c != NULL && c->robot->exchange.on)
        return er_component_refuse(c, "a step is asked for; this instance was made for model exchange");
    if (!er_component_may(c, ER_CALL_STEP))
        return false;
    c->robot->model->watches_growth = c->log.function != NULL && (c->log.categories & ER_LOG_WARNING) != 0;
    if (!er_component_tried(c, er_instance_step(c->robot, start, size)))
        return false;
    if (c->robot->warned) /* in the log only: some masters stop at a step that is not OK */
        tell_log(c, ER_LOG_WARNING, c->robot->failure.text);
    return true;
}

bool er_component_terminate(er_component *c)
{
    er_failure text;
    char number[ER_NUMBER_TEXT];
    if (!enter_phase(c, ER_CALL_TERMINATE, ER_TERMINATED))
        return false;
    er_fail(&text, "ends at %s s", er_shown(c->robot->progress.time, number));
    tell_log(c, ER_LOG_EVENTS, text.text);
    return true;
}

bool er_component_reset(er_component *c)
{
    if (!er_component_may(c, ER_CALL_ANY))
        return false;
    er_instance_reset(c->robot);
    return true;
}

bool er_component_set_reals(er_component *c, const unsigned *references, size_t count, const double *values)
{
    if (!er_component_may(c, ER_CALL_SET) || !er_component_given(c, count, references, values) ||
        !er_component_tried(c, er_instance_set_reals(c->robot, references, count, values)))
        return false;
    pass_warning_on(c);
    return true;
}

bool er_component_may_step(er_component *c, er_call call)
{
    if (c != NULL && c->robot->exchange.on)
        return er_component_refuse(c, "derivatives of inputs and statuses belong to steps; this instance was"
                                      " made for model exchange");
    return er_component_may(c, call);
}

bool er_component_set_derivatives(er_component *c, const unsigned *references, size_t count, const int *orders,
                                  const double *values)
{
    const char *ignored = NULL;
    er_failure message;
    if (!er_component_may_step(c, ER_CALL_SET) || !er_component_given(c, count, references, values) ||
        !er_component_given(c, count, orders, orders) ||
        !er_component_told(c, er_instance_set_derivatives(c->robot, references, count, orders, values, &ignored)))
        return false;
    c->warns = ignored != NULL;
    if (c->warns) {
        er_fail(&message, "derivative of %s: expected that of force, moment, qdd_cmd or the anchor's position,"
                " got one without effect", ignored);
        tell_log(c, ER_LOG_WARNING, message.text);
    }
    return true;
}

bool er_component_get_strings(er_component *c, er_call call, const unsigned *references,
                              size_t count, const char **values)
{
    bool good = er_component_may(c, call) && er_component_given(c, count, references, values);
    for (size_t i = 0; good && i < count; i++)
        good = er_component_told(c, er_instance_get_string(c->robot, references[i], &values[i]));
    return good;
}

bool er_component_set_strings(er_component *c, const unsigned *references, size_t count, const char *const *values)
{
    return er_component_may(c, count > 0 ? ER_CALL_SET_FIXED : ER_CALL_SET) &&
           er_component_given(c, count, references, values) &&
           er_component_tried(c, er_instance_set_strings(c->robot, references, count, values));
}

bool er_component_none_of(er_component *c, er_call call, const char *kind, const char *others,
                          const unsigned *references, size_t count)
{
    er_failure failure;
    if (!er_component_may(c, call) || !er_component_given(c, count, references, references))
        return false;
    if (count == 0)
        return true;
    er_fail(&failure, "%s variable %u is asked for; this FMU has %s variables only", kind, references[0], others);
    return er_component_refuse(c, failure.text);
}
