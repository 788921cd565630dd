/* Loads of the chain and products of blocks in plain C: one state after another. */
#include <math.h>
#include <stdbool.h>

#include "link_kernel.h"

typedef double er_real;
#define ER_WIDTH 1
#define ER_NAME(name) plain_##name

#include "core/step/kernel_vector.h"
#include "link_body.h"
#include "front_body.h"

er_link_kernel er_plain_link_kernel(void)
{
    return (er_link_kernel){plain_link_loads, plain_linearise, plain_add_products,
                            plain_take_products, plain_find_root, plain_forward,
                            plain_add_multiple, plain_take_product, plain_eliminate_row};
}
