/* The solver's innermost loops: sums over frames (frame_sums.py) and scattering (kernels.py).

   A frame's matrices over u = (q, q', q'') meet the control points through the four splines alive
   at it; blocks[k][e] is the block between control points k and k + e, N x N within HIGH x WIDE. */
#include <math.h>
#include <stddef.h>
#include <string.h>

/* N, MOST: coordinates and cone coefficients of a frame; HIGH, WIDE: N in whole groups of four and
   whole vectors of eight. kernels.py defines them. */
#define VECTORS (WIDE / 8)
#define BLOCK (HIGH * WIDE)
#define ROWS N /* most rows of one frame: residuals */
typedef double vec __attribute__((vector_size(64), aligned(8)));

/* Rows over u (wide = 3 N) or q (wide = N) as rows over four control points, and how many are left
   without those that are all 0: rows of feet in the air. */
static ptrdiff_t spread_rows(const double *weights, ptrdiff_t rows, ptrdiff_t wide,
                             const double *from, double (*to)[4][WIDE]) {
  ptrdiff_t left = 0;
  for (ptrdiff_t r = 0; r < rows; ++r, from += wide) {
    int some = 0;
    for (ptrdiff_t a = 0; a < wide; ++a) some |= from[a] != 0;
    if (!some) continue;
    memset(to[left], 0, sizeof to[left]);
    for (ptrdiff_t d = 0; d * N < wide; ++d)
      for (int c = 0; c < 4; ++c) {
        const double weight = weights[4 * d + c], *row = from + d * N;
        for (int a = 0; a < N; ++a) to[left][c][a] += weight * row[a];
      }
    ++left;
  }
  return left;
}

/* blocks[c][e] += sign * X_c' X_{c+e}. */
static void add_gram(ptrdiff_t rows, double (*x)[4][WIDE], double sign, double *blocks) {
  for (int c = 0; c < 4; ++c)
    for (int e = 0; c + e < 4; ++e)
      for (int b = 0; b < HIGH; b += 4) {
        vec sum[4][VECTORS] = {{{0}}};
        for (ptrdiff_t k = 0; k < rows; ++k) {
          const double *left = &x[k][c][b];
          const vec *right = (const vec *)x[k][c + e];
          for (int i = 0; i < 4; ++i)
            for (int j = 0; j < VECTORS; ++j) sum[i][j] += left[i] * right[j];
        }
        double *to = blocks + (4 * c + e) * BLOCK + b * WIDE;
        for (int i = 0; i < 4; ++i)
          for (int j = 0; j < VECTORS; ++j) *(vec *)(to + i * WIDE + 8 * j) += sign * sum[i][j];
      }
}

void add_products(ptrdiff_t frames, const ptrdiff_t *first, const double *weights, ptrdiff_t rows,
                  ptrdiff_t wide, const double *matrices, double *blocks) {
  double x[ROWS][4][WIDE];
  for (ptrdiff_t t = 0; t < frames; ++t) {
    const ptrdiff_t left = spread_rows(weights + 12 * t, rows, wide, matrices + t * rows * wide, x);
    add_gram(left, x, 1.0, blocks + first[t] * 4 * BLOCK);
  }
}

/* blocks += the sums of symmetric matrices over u: `numbers` at (rows, columns) and mirrored there,
   but what is over q alone, which is given whole. */
void add_curvature(ptrdiff_t frames, const ptrdiff_t *first, const double *weights, ptrdiff_t n,
                   const ptrdiff_t *rows, const ptrdiff_t *columns, const double *numbers,
                   const double *place, double *blocks) {
  double matrix[3 * N][3][WIDE] = {{{0}}}, *at[n], *mirrored[n]; /* the same for all frames */
  for (ptrdiff_t k = 0; k < n; ++k) {
    const ptrdiff_t i = rows[k], j = columns[k];
    at[k] = &matrix[i][j / N][j % N];
    mirrored[k] = &matrix[j][i / N][i % N];
  }
  for (ptrdiff_t t = 0; t < frames; ++t) {
    for (ptrdiff_t k = 0; k < n; ++k) *at[k] = *mirrored[k] = numbers[t * n + k];
    for (int b = 0; b < N; ++b) memcpy(matrix[b][0], place + (t * N + b) * N, sizeof(double) * N);
    const double *w = weights + 12 * t;
    for (int b = 0; b < N; ++b)
      for (int c = 0; c < 4; ++c)
        for (int e = 0; c + e < 4; ++e) {
          vec *to = (vec *)(blocks + (4 * (first[t] + c) + e) * BLOCK + b * WIDE);
          for (int d = 0; d < 3; ++d) {
            const vec *row = (const vec *)matrix[d * N + b];
            const double left = w[4 * d + c];
            const double w0 = left * w[c + e], w1 = left * w[4 + c + e], w2 = left * w[8 + c + e];
            for (int j = 0; j < VECTORS; ++j)
              to[j] += w0 * row[j] + w1 * row[VECTORS + j] + w2 * row[2 * VECTORS + j];
          }
        }
  }
}

/* Takes lambda out of the blocks; 1 if an inner block is not positive. */
int eliminate(ptrdiff_t frames, const ptrdiff_t *first, const double *weights,
              const ptrdiff_t *count, const ptrdiff_t *at, double delta, const double *inner,
              const double *diagonal, const double *mixed_gauss, const double *mixed_curved,
              double *lower, double *half, double *blocks) {
  double x[ROWS][4][WIDE], compact[MOST][3 * N];
  for (ptrdiff_t t = 0; t < frames; ++t) {
    const ptrdiff_t n = count[t], *chosen = at + MOST * t;
    double *l = lower + MOST * MOST * t;
    for (ptrdiff_t i = 0; i < n; ++i) {
      const ptrdiff_t p = MOST * t + chosen[i];
      for (int a = 0; a < 3 * N; ++a) compact[i][a] = (1 + delta) * mixed_gauss[p * 3 * N + a];
      for (int a = 0; a < N; ++a) compact[i][a] += mixed_curved[p * N + a];
      for (ptrdiff_t j = 0; j <= i; ++j) {
        double sum = (1 + delta) * inner[p * MOST + chosen[j]];
        if (i == j) sum += diagonal[p] + delta;
        for (ptrdiff_t k = 0; k < j; ++k) sum -= l[i * MOST + k] * l[j * MOST + k];
        if (i == j && !(sum > 0 && sum < INFINITY)) return 1;
        l[i * MOST + j] = i == j ? sqrt(sum) : sum / l[j * MOST + j];
      }
      for (ptrdiff_t k = 0; k < i; ++k)
        for (int a = 0; a < 3 * N; ++a) compact[i][a] -= l[i * MOST + k] * compact[k][a];
      for (int a = 0; a < 3 * N; ++a) compact[i][a] /= l[i * MOST + i];
      memcpy(half + p * 3 * N, compact[i], sizeof compact[i]);
    }
    const ptrdiff_t left = spread_rows(weights + 12 * t, n, 3 * N, compact[0], x);
    add_gram(left, x, -1.0, blocks + first[t] * 4 * BLOCK);
  }
  return 0;
}

/* to = L^-1 from, or L^-T from, of the coefficients that bear; right-hand sides (MOST, columns). */
void substitute(ptrdiff_t frames, const ptrdiff_t *count, const ptrdiff_t *at, const double *lower,
                ptrdiff_t columns, int transposed, const double *from, double *to) {
  for (ptrdiff_t t = 0; t < frames; ++t) {
    const ptrdiff_t n = count[t], *chosen = at + MOST * t;
    const double *l = lower + MOST * MOST * t;
    from += t ? MOST * columns : 0;
    to += t ? MOST * columns : 0;
    for (ptrdiff_t s = 0; s < n; ++s) {
      const ptrdiff_t i = transposed ? n - 1 - s : s;
      double *own = to + chosen[i] * columns;
      memcpy(own, from + chosen[i] * columns, sizeof(double) * columns);
      for (ptrdiff_t r = 0; r < s; ++r) {
        const ptrdiff_t k = transposed ? n - 1 - r : r;
        const double by = transposed ? l[k * MOST + i] : l[i * MOST + k], *row = to + chosen[k] * columns;
        for (ptrdiff_t a = 0; a < columns; ++a) own[a] -= by * row[a];
      }
      for (ptrdiff_t a = 0; a < columns; ++a) own[a] /= l[i * MOST + i];
    }
  }
}

/* The first n of each frame's `all` numbers to places of matrices that lie end to end, `size`
   numbers a frame. */
void scatter(ptrdiff_t frames, ptrdiff_t n, ptrdiff_t all, ptrdiff_t size, const ptrdiff_t *places,
             const double *numbers, double *to) {
  for (ptrdiff_t t = 0; t < frames; ++t)
    for (ptrdiff_t k = 0; k < n; ++k) to[t * size + places[k]] = numbers[t * all + k];
}

/* Blocks as columns of a lower band, 4 N high: shift (controls, 4) is added to each block's
   diagonal, `added` to the band's. */
void lay_out(ptrdiff_t controls, const double *blocks, const double *shift, const double *added,
             double *band) {
  for (ptrdiff_t k = 0; k < controls; ++k)
    for (ptrdiff_t b = 0; b < N; ++b, band += 4 * N) {
      const double *from = blocks + k * 4 * BLOCK + b * WIDE;
      memcpy(band, from + b, sizeof(double) * (N - b));
      for (ptrdiff_t e = 1; e < 4; ++e) memcpy(band + e * N - b, from + e * BLOCK, sizeof(double) * N);
      memset(band + 4 * N - b, 0, sizeof(double) * b);
      for (ptrdiff_t e = 0; e < 4; ++e) band[e * N] += shift[4 * k + e];
      band[0] += added[k * N + b];
    }
}
