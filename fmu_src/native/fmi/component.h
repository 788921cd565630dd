/* An instance as its master sees it: what FMI 2.0 and FMI 3.0 have in common.
 *
 * A function that returns false has told the master why, and has changed nothing; without an instance
 * (NULL) it is false at once.
 */
#ifndef ER_COMPONENT_H
#define ER_COMPONENT_H

#include "instance.h"

/* File of the robot's data among the resources. */
#define ER_ROBOT_FILE "robot.txt"

typedef struct er_component er_component;

/* The master's log. */
typedef struct {
    /* Calls the function below. */
    void (*tell)(const er_component *c, int status, const char *category, const char *text);
    void (*function)(void); /* of the version's own type; NULL: the master has none */
    void *environment;
    unsigned categories; /* that are on */
} er_log;

struct er_component {
    er_instance *robot;
    er_log log;
    bool warns;    /* the call is answered by a warning, which was told */
    bool discards; /* the refusal that was told last leaves the master another try */
    char name[];
};

/* Statuses, which FMI 2.0 and FMI 3.0 give the same numbers. */
enum { ER_OK,
       ER_WARNING,
       ER_DISCARD,
       ER_ERROR };

static inline int er_status(bool good)
{
    return good ? ER_OK : ER_ERROR;
}

/* That of a call that may be tried again where its refusal says so; and of one that may have warned, too. */
static inline int er_status_tried(const er_component *c, bool good)
{
    return !good && c != NULL && c->discards ? ER_DISCARD : er_status(good);
}

static inline int er_status_taken(const er_component *c, bool good)
{
    return good && c->warns ? ER_WARNING : er_status_tried(c, good);
}

/* Takes over a robot; NULL, after telling the failure, if there is none. */
er_component *er_component_create(const char *name, er_log log, er_instance *robot, const er_failure *failure);
void er_component_free(er_component *c);

/* Tells the master a sentence and returns false. */
bool er_component_refuse(er_component *c, const char *text);

/* Tells the master, where it wants to hear of it, what is not there to be told. */
void er_component_discard(er_component *c, const char *text);

/* Passes the success of a call on, or tells the instance's failure. */
bool er_component_told(er_component *c, bool good);

/* The same for a call that may be tried again, differently, where its failure says so. */
bool er_component_tried(er_component *c, bool good);

/* Whether there is an instance that may be called so now. */
bool er_component_may(er_component *c, er_call call);

/* The same of a call that belongs to steps: an instance of model exchange makes none. */
bool er_component_may_step(er_component *c, er_call call);

/* Refuses missing arrays where there is something to put into them. */
bool er_component_given(er_component *c, size_t count, const void *first, const void *second);

/* Turns categories of the log on or off; the others stay as they are, or are off. */
bool er_component_log(er_component *c, bool on, bool others_stay, const char *const *categories, size_t count);

/* Without a stop time it is infinite. */
bool er_component_setup(er_component *c, double start, double stop, double tolerance);
bool er_component_enter(er_component *c);
bool er_component_exit(er_component *c);
bool er_component_step(er_component *c, double start, double size);
bool er_component_terminate(er_component *c);
bool er_component_reset(er_component *c);
bool er_component_set_reals(er_component *c, const unsigned *references, size_t count, const double *values);
bool er_component_set_derivatives(er_component *c, const unsigned *references, size_t count, const int *orders,
                                  const double *values);
bool er_component_get_strings(er_component *c, er_call call, const unsigned *references,
                              size_t count, const char **values);
bool er_component_set_strings(er_component *c, const unsigned *references, size_t count, const char *const *values);

/* Refuses variables of a kind that this FMU does not have. */
bool er_component_none_of(er_component *c, er_call call, const char *kind, const char *others,
                          const unsigned *references, size_t count);

#endif
