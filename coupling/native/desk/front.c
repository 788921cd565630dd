#include "front.h"

#include <stdlib.h>
#include <string.h>

/* Nodes of the store for each that stays when it is emptied. */
#define ROOM 4

/* A row of the store: U, what follows it for each node that is met, the right-hand side, reciprocals of U's diagonal,
 * and how many nodes are met. */
static double *row_of(const er_front *front, int64_t node)
{
    return front->store + node % front->room * front->row;
}

static double *right_in_row(const er_front *front, double *row)
{
    return row + ER_REACH * front->size * front->size;
}

static double *reciprocal_in_row(const er_front *front, double *row)
{
    return right_in_row(front, row) + front->size;
}

static int *reach_in_row(const er_front *front, double *row)
{
    return (int *)(reciprocal_in_row(front, row) + front->size);
}

/* A node that comes to the front knows nothing; what pads its quantities is one by itself. */
static void clear_node(er_front *front, int64_t node)
{
    int slot = (int)(node % ER_REACH), n = front->size;
    size_t block = (size_t)n * n * sizeof(double);
    for (int other = 0; other < ER_REACH; other++) {
        memset(front->block[slot][other], 0, block);
        memset(front->block[other][slot], 0, block);
    }
    memset(front->right[slot], 0, n * sizeof(double));
    for (int q = front->quantities; q < n; q++)
        front->block[slot][slot][q * n + q] = 1.0;
}

bool er_front_create(er_front *front, const er_link_kernel *kernel, int quantities, int64_t lag)
{
    int n = (quantities + ER_LANES - 1) / ER_LANES * ER_LANES;
    size_t blocks = (size_t)ER_REACH * ER_REACH * n * n, right = (size_t)ER_REACH * n, numbers;
    double *at;
    memset(front, 0, sizeof *front);
    front->kernel = kernel;
    front->quantities = quantities;
    front->size = n;
    front->lag = lag;
    front->room = ROOM * lag;
    front->row = (int64_t)ER_REACH * n * n + 2 * n + ER_LANES;
    numbers = blocks + right + (size_t)front->room * front->row + (size_t)(front->room + ER_REACH) * n;
    front->memory = malloc(numbers * sizeof(double) + ER_ALIGNMENT);
    if (front->memory == NULL)
        return false;
    at = er_aligned(front->memory);
    for (int i = 0; i < ER_REACH; i++)
        for (int k = 0; k < ER_REACH; k++, at += n * n)
            front->block[i][k] = at;
    for (int i = 0; i < ER_REACH; i++, at += n)
        front->right[i] = at;
    front->store = at;
    front->solution = at + front->room * front->row;
    return true;
}

void er_front_start(er_front *front)
{
    front->first = front->next = 0;
    for (int node = 0; node < ER_REACH; node++)
        clear_node(front, node);
}

void er_front_free(er_front *front)
{
    free(front->memory);
}

bool er_front_eliminate(er_front *front, int reach)
{
    const er_link_kernel *kernel = front->kernel;
    int n = front->size;
    int64_t node = front->next;
    size_t block = (size_t)n * n;
    double *row = row_of(front, node), *right = right_in_row(front, row), *reciprocal = reciprocal_in_row(front, row);
    memcpy(row, er_front_block(front, node, node), block * sizeof(double));
    memcpy(right, er_front_right(front, node), n * sizeof(double));
    if (!kernel->find_root(n, row, reciprocal))
        return false;
    for (int k = 0; k < n; k++) {
        right[k] *= reciprocal[k];
        for (int r = k + 1; r < n; r++)
            right[r] -= row[k * n + r] * right[k];
    }
    *reach_in_row(front, row) = reach;
    for (int k = 1; k <= reach; k++) {
        double *behind = row + k * block, *its_right = er_front_right(front, node + k);
        memcpy(behind, er_front_block(front, node, node + k), block * sizeof(double));
        kernel->forward(n, row, reciprocal, behind);
        for (int i = 1; i <= k; i++)
            kernel->take_products(n, n, n, row + i * block, behind, er_front_block(front, node + i, node + k));
        for (int r = 0; r < n; r++)
            kernel->add_multiple(n, -right[r], behind + r * n, its_right);
    }
    clear_node(front, node);
    front->next++;
    return true;
}

void er_front_go_back(er_front *front)
{
    int n = front->size;
    double *solution = front->solution;
    memset(solution + (front->next - front->first) * n, 0, (size_t)ER_REACH * n * sizeof(double));
    for (int64_t node = front->next - 1; node >= front->first; node--) {
        double *row = row_of(front, node), *reciprocal = reciprocal_in_row(front, row);
        double *x = solution + (node - front->first) * n;
        memcpy(x, right_in_row(front, row), n * sizeof(double));
        for (int k = *reach_in_row(front, row); k > 0; k--)
            front->kernel->take_product(n, row + (size_t)k * n * n, x + k * n, x);
        for (int k = n - 1; k >= 0; k--) {
            double rest = x[k];
            for (int c = k + 1; c < n; c++)
                rest -= row[k * n + c] * x[c];
            x[k] = rest * reciprocal[k];
        }
    }
}

void er_front_keep_last(er_front *front)
{
    front->first = front->next - front->lag;
}
