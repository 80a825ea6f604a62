// Compiled with -ffast-math and without vectorisation: a vectorised loop and its scalar rest would differ in
// their bits, and with them the answers for one pixel.
#include "numeric/apart.h"

#define RASTERBENCH_APART fastmath
#define MUL_ADD(a, b, c) ((a) * (b) + (c))
#define MUL_SUB(a, b, c, d) ((a) * (b) - (c) * (d))
#include "numeric/apart.inc"
