/* The kernel in plain C: one state after another. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "loads.h"

typedef double er_real;
#define ER_WIDTH 1
#define ER_NAME(name) plain_##name

#include "loads_kernel.h"

er_kernel er_plain_kernel(void)
{
    return (er_kernel){plain_turn, plain_loads};
}
