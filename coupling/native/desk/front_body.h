/* Products and factors of the blocks of normal equations, once for every width of `er_real`.
 *
 * Blocks are n x n by rows, n a multiple of ER_LANES.  Included behind kernel_vector.h.
 */

/* Rows of a tile, and registers beside each other in it. */
#define TILE_ROWS 2
#define TILE (12 / ER_WIDTH)

/* C += sign A^T B in a tile `wide` registers wide. */
ER_INLINE void add_tile(int wide, int n, int count, int stride, double sign, const double *A, const double *B, double *C)
{
    er_real sum[TILE_ROWS][TILE];
    for (int r = 0; r < TILE_ROWS; r++)
        for (int c = 0; c < wide; c++)
            sum[r][c] = load(C + r * n + c * ER_WIDTH);
    for (int k = 0; k < count; k++, A += stride, B += stride)
        for (int r = 0; r < TILE_ROWS; r++)
            for (int c = 0; c < wide; c++)
                sum[r][c] += sign * A[r] * load(B + c * ER_WIDTH);
    for (int r = 0; r < TILE_ROWS; r++)
        for (int c = 0; c < wide; c++)
            *(er_real *)(C + r * n + c * ER_WIDTH) = sum[r][c];
}

ER_INLINE void add_signed_products(int n, int count, int stride, double sign, const double *A, const double *B, double *C)
{
    for (int row = 0; row < n; row += TILE_ROWS) {
        int column = 0;
        for (; column + TILE * ER_WIDTH <= n; column += TILE * ER_WIDTH)
            add_tile(TILE, n, count, stride, sign, A + row, B + column, C + row * n + column);
        for (; column < n; column += ER_WIDTH)
            add_tile(1, n, count, stride, sign, A + row, B + column, C + row * n + column);
    }
}

static void ER_NAME(add_products)(int n, int count, int stride, const double *A, const double *B, double *C)
{
    add_signed_products(n, count, stride, 1.0, A, B, C);
}

static void ER_NAME(take_products)(int n, int count, int stride, const double *A, const double *B, double *C)
{
    add_signed_products(n, count, stride, -1.0, A, B, C);
}

/* row -= factor pivot, from a place on that is a multiple of ER_WIDTH. */
ER_INLINE void take_row(int from, int n, double factor, const double *pivot, double *row)
{
    for (int c = from; c < n; c += ER_WIDTH)
        *(er_real *)(row + c) -= factor * load(pivot + c);
}

static bool ER_NAME(find_root)(int n, double *matrix, double *reciprocal)
{
    for (int k = 0; k < n; k++) {
        double *pivot = matrix + k * n;
        if (!(pivot[k] > 0.0 && pivot[k] < INFINITY))
            return false;
        reciprocal[k] = 1.0 / sqrt(pivot[k]);
        for (int c = k / ER_WIDTH * ER_WIDTH; c < n; c += ER_WIDTH)
            *(er_real *)(pivot + c) *= reciprocal[k];
        for (int r = k + 1; r < n; r++)
            take_row(r / ER_WIDTH * ER_WIDTH, n, pivot[r], pivot, matrix + r * n);
    }
    return true;
}

static void ER_NAME(forward)(int n, const double *U, const double *reciprocal, double *rows)
{
    for (int k = 0; k < n; k++) {
        double *pivot = rows + k * n;
        for (int c = 0; c < n; c += ER_WIDTH)
            *(er_real *)(pivot + c) *= reciprocal[k];
        for (int r = k + 1; r < n; r++)
            take_row(0, n, U[k * n + r], pivot, rows + r * n);
    }
}

static void ER_NAME(add_multiple)(int count, double factor, const double *M, double *C)
{
    for (int k = 0; k < count; k += ER_WIDTH)
        *(er_real *)(C + k) += factor * load(M + k);
}

static void ER_NAME(take_product)(int n, const double *B, const double *x, double *y)
{
    for (int r = 0; r < n; r++, B += n) {
        ER_ALIGNED double sums[ER_LANES];
        er_real sum = load(B) * load(x);
        for (int c = ER_WIDTH; c < n; c += ER_WIDTH)
            sum += load(B + c) * load(x + c);
        *(er_real *)sums = sum;
        for (int c = 0; c < ER_WIDTH; c++)
            y[r] -= sums[c];
    }
}

/* Numbers of a row that need not be aligned. */
#if ER_WIDTH > 1
typedef double loose __attribute__((vector_size(8 * ER_WIDTH), aligned(8), may_alias));
#else
typedef double loose;
#endif

static bool ER_NAME(eliminate_row)(int width, int room, double *rows, double *right)
{
    double reciprocal;
    if (!(rows[0] > 0.0 && rows[0] < INFINITY))
        return false;
    reciprocal = 1.0 / sqrt(rows[0]);
    for (int k = 0; k < width; k++)
        rows[k] *= reciprocal;
    right[0] *= reciprocal;
    for (int k = 1; k < width; k++) {
        double *row = rows + k * room, factor = rows[k];
        right[k] -= factor * right[0];
        if (factor != 0.0)
            for (int c = 0; c < width - k; c += ER_WIDTH)
                *(loose *)(row + c) -= factor * *(const loose *)(rows + k + c);
    }
    return true;
}
