// A scene made to provoke races in programs that draw triangles in parallel into one z-buffer.
#pragma once

#include "scene/scene.h"

namespace rasterbench {

/// Small triangles in stacks, 320 x 180 pixels. Two threads that draw triangles of one stack at the same time
/// write the same pixels; the order of the ids makes that happen under dynamic schedules of chunk 1, where
/// threads draw neighbours in the list (ids 2k and 2k + 1 are of one stack), and under static ones on 2, 4, 8
/// and 16 threads, which all begin at the same stack. Each triangle is nearer than those of its stack before
/// it, by far more than roundings, so that both threads pass the depth test and a lost update shows;
/// neighbours in depth have different colours. Nothing crosses the near plane or leaves the picture.
Scene race_scene();

}  // namespace rasterbench
