#include "memory.h"

#include "../step/stepper.h"

void er_memory_copy(const er_robot *robot, er_memory *to, const er_memory *from)
{
    const size_t path = offsetof(er_memory, options.trajectory), behind = offsetof(er_memory, parameters);
    memcpy(to, from, path + strlen(from->options.trajectory) + 1);
    memcpy((char *)to + behind, (const char *)from + behind,
           offsetof(er_memory, state) - behind + er_state_size(robot));
}
