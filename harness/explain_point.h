// Where the time of a point goes.
#pragma once

#include "harness/point.h"

namespace rasterbench {

/// Verifies that `point` conforms, times `samples` of its frames, counts others, measures its floor and the
/// cost ladder of its scene, and says which bound holds: the object of records.md, "explain". Shows progress
/// on stderr. Throws InputError for a peer and for a kernel that its mode does not suit, Error where the
/// point does not conform or its threads do not run. `samples` >= 1.
Json explain_point(const Point& point, const Scene& scene, int samples);

}  // namespace rasterbench
