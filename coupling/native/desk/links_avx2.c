/* The same with four states, or numbers of a row, in the lanes of AVX2 registers. */
#include <math.h>
#include <stdbool.h>

#include "core/chain/processor.h"
#include "link_kernel.h"

#if defined(ER_VECTORS)

ER_BEGIN_AVX2

typedef double er_real __attribute__((vector_size(8 * ER_LANES), may_alias));
#define ER_WIDTH ER_LANES
#define ER_NAME(name) avx2_##name

#include "core/step/kernel_vector.h"
#include "link_body.h"
#include "front_body.h"

ER_END_AVX2

er_link_kernel er_best_link_kernel(void)
{
    return er_has_avx2() ? (er_link_kernel){avx2_link_loads, avx2_linearise, avx2_add_products,
                                            avx2_take_products, avx2_find_root, avx2_forward,
                                            avx2_add_multiple, avx2_take_product, avx2_eliminate_row}
                         : er_plain_link_kernel();
}

#else

er_link_kernel er_best_link_kernel(void)
{
    return er_plain_link_kernel();
}

#endif
