// Makes a failing case small: fewer triangles, a smaller image, simpler numbers.
#pragma once

#include "base/function_ref.h"
#include "fuzz/case.h"

namespace rasterbench::fuzz {

/// A case for which `fails` is still true and that no single step makes simpler; `fails` is true for
/// `failing` and is asked at most `most_questions` times. Deterministic. Delta debugging (Zeller &
/// Hildebrandt, Simplifying and isolating failure-inducing input, 2002) on the list of triangles; then each
/// number is replaced by a simpler one: zero, a whole or half number, fewer significant bits.
FuzzCase shrink(const FuzzCase& failing, FunctionRef<bool(const FuzzCase&)> fails, int most_questions);

/// How much there is to read in a number: 0 for +0, more for every significant bit and for a large or small
/// exponent. A number is only replaced by one of less complexity.
int complexity(double v);

}  // namespace rasterbench::fuzz
