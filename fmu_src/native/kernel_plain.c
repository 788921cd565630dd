/* The kernel in plain C: one state after another. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "gauss.h"
#include "kernel.h"

typedef double er_real;
#define ER_WIDTH 1
#define ER_NAME(name) plain_##name

#include "kernel_body.h"
#include "kernel_tangent.h"

er_kernel er_plain_kernel(void)
{
    return (er_kernel){plain_turn, plain_loads, plain_stages, plain_factor, plain_improve,
                       plain_filter, plain_link, plain_tangent};
}
