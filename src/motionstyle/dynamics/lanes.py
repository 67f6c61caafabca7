"""Generated C that works on several frames at once, one in each lane of the processor's vectors.

What CasADi generates for one frame is a long list of scalar assignments: the second derivatives of
the dynamics are 400 000 of them, 5 MB of machine code that must be fetched anew for every frame.
With a vector type of GCC and Clang for each number the same list serves 8, 4 or 2 frames at once.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_HEAD = """
#include <math.h>
#include <stddef.h>
#if defined(__AVX512F__)
#define LANES 8
#elif defined(__AVX__)
#define LANES 4
#else
#define LANES 2
#endif
typedef double lanes __attribute__((vector_size(8 * LANES)));
#define ALL(x) ((lanes){0} + (x))
#define EACH(name, of) static __attribute__((noinline)) lanes name(lanes x) { \\
    for (int i = 0; i < LANES; ++i) x[i] = of(x[i]); return x; }
EACH(lanes_sin, sin)
EACH(lanes_cos, cos)
#define casadi_real lanes
int lanes_count(void) { return LANES; }
"""
# The last lanes repeat the last frame where frames run out.
_LOOP = """
int {name}_frames(ptrdiff_t count, const double** arg, const ptrdiff_t* arg_step,
    const ptrdiff_t* arg_size, double** res, const ptrdiff_t* res_size, lanes** space) {{
  const lanes** a = (const lanes**)space;
  lanes** r = space + {name}_n_in();
  for (ptrdiff_t t = 0; t < count; t += LANES) {{
    for (int i = 0; i < {name}_n_in(); ++i)
      for (int l = 0; l < LANES; ++l) {{
        const double* from = arg[i] + (t + l < count ? t + l : count - 1) * arg_step[i];
        for (ptrdiff_t k = 0; k < arg_size[i]; ++k) space[i][k][l] = from[k];
      }}
    int flag = {name}(a, r, 0, 0, 0);
    if (flag) return flag;
    for (int i = 0; i < {name}_n_out(); ++i)
      for (int l = 0; l < LANES && t + l < count; ++l) {{
        double* to = res[i] + (t + l) * res_size[i];
        for (ptrdiff_t k = 0; k < res_size[i]; ++k) to[k] = r[i][k][l];
      }}
  }}
  return 0;
}}
"""


def in_lanes(source: str, names: Sequence[str]) -> str:
    """Return generated C in which every number is a vector, and loops `{name}_frames`.

    Parameters
    ----------
    source : of `casadi.CodeGenerator`, of functions of sums, products, sines and cosines whose
        arguments are all given. names : of the functions.
    """
    # Vectors and scalars mix in products and sums, but not in assignments and conditions.
    source = re.sub(r"=arg\[(\d+)\]\? arg\[\1\]\[(\d+)\] : 0;", r"=arg[\1][\2];", source)
    source = re.sub(r"(\ba\d+)=(-?[0-9][0-9.e+-]*);", r"\1=ALL(\2);", source)
    source = re.sub(r"=(sin|cos)\(", r"=lanes_\1(", source)
    source = re.sub(r"casadi_real (\w+_default_in)", r"double \1", source)
    return _HEAD + source + "".join(_LOOP.format(name=name) for name in names)
