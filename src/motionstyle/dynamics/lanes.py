"""Generated C that works on several frames at once, one in each lane of the processor's vectors.

What CasADi generates for one frame is a long list of scalar assignments: the second derivatives of
the dynamics are 400 000 of them, 5 MB of machine code that must be fetched anew for every frame.
With a vector type of GCC and Clang for each number the same list serves 8, 4 or 2 frames at once.
The list is cut into pieces, and all frames go through one piece before the next is begun, so that a
piece and its numbers stay in the processor's nearest memories. What a later piece needs is kept in
between. Two to three times as fast as one list for the second derivatives, the same to the last bit
(at -O1; compilers that fuse products and sums round a little otherwise).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

PIECE = 500  # assignments; of 2000 the second derivatives take a third longer
_HEAD = """
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#if defined(__AVX512F__)
#define LANES 8
#elif defined(__AVX__)
#define LANES 4
#else
#define LANES 2
#endif
#define BATCH 4 /* groups of lanes that go through a piece before the next one */
typedef double lanes __attribute__((vector_size(8 * LANES)));
#define ALL(x) ((lanes){0} + (x))
#define EACH(name, of) static __attribute__((noinline)) lanes name(lanes x) { \\
    for (int i = 0; i < LANES; ++i) x[i] = of(x[i]); return x; }
EACH(lanes_sin, sin)
EACH(lanes_cos, cos)
#define casadi_real lanes
int lanes_count(void) { return LANES; }
#define PIECE_OF static __attribute__((noinline)) void
#define GIVEN const lanes* const* restrict arg, lanes* const* restrict res, lanes* restrict kept
"""
# The last lanes repeat the last frame where frames run out.
_LOOP = """
int {name}_in_lanes(ptrdiff_t count, const double** arg, const ptrdiff_t* arg_step,
    const ptrdiff_t* arg_size, double** res, const ptrdiff_t* res_size) {{
  const int ins = {name}_n_in(), outs = {name}_n_out();
  ptrdiff_t each = {kept};
  for (int i = 0; i < ins; ++i) each += arg_size[i];
  for (int i = 0; i < outs; ++i) each += res_size[i];
  lanes* memory = aligned_alloc(sizeof(lanes), sizeof(lanes) * each * BATCH);
  if (!memory) return 1;
  const lanes* a[BATCH][ins];
  lanes* r[BATCH][outs];
  for (ptrdiff_t first = 0; first < count; first += BATCH * LANES) {{
    int groups = 0;
    for (ptrdiff_t t = first; groups < BATCH && t < count; t += LANES, ++groups) {{
      lanes* at = memory + groups * each + {kept};
      for (int i = 0; i < ins; at += arg_size[i++]) {{
        a[groups][i] = at;
        for (int l = 0; l < LANES; ++l) {{
          const double* from = arg[i] + (t + l < count ? t + l : count - 1) * arg_step[i];
          for (ptrdiff_t k = 0; k < arg_size[i]; ++k) at[k][l] = from[k];
        }}
      }}
      for (int i = 0; i < outs; at += res_size[i++]) r[groups][i] = at;
    }}
    for (int p = 0; p < {pieces}; ++p)
      for (int g = 0; g < groups; ++g) {inner}_pieces[p](a[g], r[g], memory + g * each);
    for (int g = 0; g < groups; ++g)
      for (int i = 0; i < outs; ++i)
        for (ptrdiff_t t = first + g * LANES, l = 0; l < LANES && t + l < count; ++l)
          for (ptrdiff_t k = 0; k < res_size[i]; ++k)
            res[i][(t + l) * res_size[i] + k] = r[g][i][k][l];
  }}
  free(memory);
  return 0;
}}
"""
_ARGUMENTS = (
    r"const casadi_real\*\* arg, casadi_real\*\* res, casadi_int\* iw, casadi_real\* w, int mem"
)
_BODY = re.compile(
    rf"static int (casadi_f\d+)\({_ARGUMENTS}\) \{{\n(.*?)  return 0;\n\}}\n", re.DOTALL
)
_EXPORT = re.compile(
    rf"CASADI_SYMBOL_EXPORT int (\w+)\({_ARGUMENTS}\)\s*\{{\n"
    r"  return (casadi_f\d+)\(arg, res, iw, w, mem\);\n\}\n"
)
_VARIABLE = re.compile(r"\ba\d+\b")


def in_lanes(source: str, names: Sequence[str]) -> str:
    """Return generated C in which every number is a vector, and loops `{name}_in_lanes`.

    Parameters
    ----------
    source : of `casadi.CodeGenerator`, of functions of sums, products, sines and cosines whose
        arguments are all given. names : of the functions.

    Raises
    ------
    ValueError
        If the source has no function of a name, as CasADi is known to write them.
    """
    # Vectors and scalars mix in products and sums, but not in assignments and conditions.
    source = re.sub(r"=arg\[(\d+)\]\? arg\[\1\]\[(\d+)\] : 0;", r"=arg[\1][\2];", source)
    source = re.sub(r"(\ba\d+)=(-?[0-9][0-9.e+-]*);", r"\1=ALL(\2);", source)
    source = re.sub(r"=(sin|cos)\(", r"=lanes_\1(", source)
    source = re.sub(r"casadi_real (\w+_default_in)", r"double \1", source)
    source = re.sub(r"if \(res\[(\d+)\]!=0\) res\[\1\]", r"res[\1]", source)
    inner = dict(_EXPORT.findall(source))
    sizes: dict[str, dict[str, int]] = {}

    def cut(found: re.Match[str]) -> str:
        pieces, kept = _pieces(found[2])
        sizes[found[1]] = {"pieces": len(pieces), "kept": kept}
        texts = [f"PIECE_OF {found[1]}_{k}(GIVEN) {{\n{p}}}\n" for k, p in enumerate(pieces)]
        every = ", ".join(f"{found[1]}_{k}" for k in range(len(pieces)))
        return "".join(texts) + f"static void (*const {found[1]}_pieces[])(GIVEN) = {{{every}}};\n"

    source = _BODY.sub(cut, _EXPORT.sub("", source))
    missing = [name for name in names if inner.get(name) not in sizes]
    if missing:
        raise ValueError(
            f"the generated C has no {', '.join(missing)} as CasADi is known to write it"
        )
    loops = [_LOOP.format(name=name, inner=inner[name], **sizes[inner[name]]) for name in names]
    return _HEAD + source + "".join(loops)


def _pieces(body: str) -> tuple[list[str], int]:
    """Return a function's assignments in pieces, and how many numbers are kept between them."""
    lines = [line for line in body.splitlines() if line.strip()]
    declared = [line for line in lines if line.startswith("  casadi_real ")]
    assigned = [line for line in lines if not line.startswith("  casadi_real ")]
    place = {v: k for k, v in enumerate(_VARIABLE.findall(" ".join(declared)))}
    parts = [assigned[k : k + PIECE] for k in range(0, len(assigned), PIECE)]
    uses = [_used(part) for part in parts]
    needed: set[str] = set()
    texts = []
    for part, (written, read) in zip(reversed(parts), reversed(uses), strict=True):
        given = [f"  lanes {v} = kept[{place[v]}];" for v in sorted(read)]
        own = [f"  lanes {v};" for v in sorted(written - read)]
        handed = [f"  kept[{place[v]}] = {v};" for v in sorted(written & needed)]
        texts.append("\n".join([*given, *own, *part, *handed, ""]))
        needed = (needed - written) | read
    return texts[::-1], len(place)


def _used(lines: Sequence[str]) -> tuple[set[str], set[str]]:
    """Return the numbers that assignments write, and those they read before they write them."""
    written: set[str] = set()
    read: set[str] = set()
    for line in lines:
        left, right = line.split("=", 1)
        read |= {v for v in _VARIABLE.findall(right) if v not in written}
        written |= set(_VARIABLE.findall(left))
    return written, read
