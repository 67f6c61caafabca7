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

/* Rows over u (wide = 3 N) or q (wide = N) as rows over four control points. */
static void spread_rows(const double *weights, ptrdiff_t rows, ptrdiff_t wide, const double *from,
                        double (*to)[4][WIDE]) {
  memset(to, 0, sizeof(double) * rows * 4 * WIDE);
  for (ptrdiff_t r = 0; r < rows; ++r)
    for (ptrdiff_t d = 0; d * N < wide; ++d)
      for (int c = 0; c < 4; ++c) {
        const double weight = weights[4 * d + c], *row = from + r * wide + d * N;
        for (int a = 0; a < N; ++a) to[r][c][a] += weight * row[a];
      }
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
    spread_rows(weights + 12 * t, rows, wide, matrices + t * rows * wide, x);
    add_gram(rows, x, 1.0, blocks + first[t] * 4 * BLOCK);
  }
}

void add_matrices(ptrdiff_t frames, const ptrdiff_t *first, const double *weights,
                  const double *matrices, double *blocks) {
  for (ptrdiff_t t = 0; t < frames; ++t) {
    const double *w = weights + 12 * t, *matrix = matrices + t * 9 * N * N;
    double *own = blocks + first[t] * 4 * BLOCK;
    for (int d = 0; d < 3; ++d)
      for (int b = 0; b < N; ++b) {
        const double *row = matrix + (d * N + b) * 3 * N;
        for (int c = 0; c < 4; ++c)
          for (int e = 0; c + e < 4; ++e) {
            const double left = w[4 * d + c], w0 = left * w[c + e], w1 = left * w[4 + c + e],
                         w2 = left * w[8 + c + e];
            double *to = own + (4 * c + e) * BLOCK + b * WIDE;
            for (int a = 0; a < N; ++a) to[a] += w0 * row[a] + w1 * row[N + a] + w2 * row[2 * N + a];
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
    spread_rows(weights + 12 * t, n, 3 * N, compact[0], x);
    add_gram(n, x, -1.0, blocks + first[t] * 4 * BLOCK);
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

/* Numbers (frames, n) to places of matrices that lie end to end, `size` numbers a frame. */
void scatter(ptrdiff_t frames, ptrdiff_t n, ptrdiff_t size, const ptrdiff_t *places,
             const double *numbers, double *to) {
  for (ptrdiff_t t = 0; t < frames; ++t)
    for (ptrdiff_t k = 0; k < n; ++k) to[t * size + places[k]] = numbers[t * n + k];
}
