// Compiled with -mfma on x86. The contractions are spelled out, so that they do not depend on the compiler.
#include "numeric/apart.h"

#define RASTERBENCH_APART fma
#define MUL_ADD(a, b, c) __builtin_fmaf((a), (b), (c))
#define MUL_SUB(a, b, c, d) __builtin_fmaf((a), (b), -((c) * (d)))
#include "numeric/apart.inc"
