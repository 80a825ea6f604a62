// What is known of llvmpipe without asking it: the variables that make it one, and the bound that its
// pictures are judged by.
//
// The vertex shader multiplies by the camera's rows, rounded to float32, and everything up to the window
// coordinates is in float32 as well. Footprint counts 64 roundings, 31 of the picture that is judged, as many
// of the truth, which here is in double, and two to spare: half the unit makes them the 32 of llvmpipe, the
// rounding of the rows included. Coverage is in integers, exact on corners that are snapped to 1/256 px
// (subpixel_snap() in lp_setup_tri.c, FIXED_ORDER in lp_rast.h, both in src/gallium/drivers/llvmpipe). Depth
// is a plane through the unsnapped corners, a0 + dadx x + dady y from the window's origin (lp_state_setup.c;
// a later Mesa starts from the first corner, which is nearer); its ten roundings of float32 are five of twice
// the unit. It is stored as (d + 1) / 2, of which a unit is two of d.
#include "reference/llvmpipe.h"

namespace rasterbench {

const char* const kLlvmpipeBoundText =
    "edges within 0.707/256 px (corners snapped to 8 bits of subpixels) plus 32 float32 roundings of the "
    "transform, gamma_32 (|row| |P|) / w in pixels; depth within the rounding of a float32 plane from the "
    "window's origin and the same transform";
const char* const kLlvmpipeBoundSource =
    "Mesa, src/gallium/drivers/llvmpipe: FIXED_ORDER in lp_rast.h, lp_setup_tri.c, lp_state_setup.c; Higham "
    "2002, 3.1";

std::map<std::string, std::string> llvmpipe_variables(int threads) {
  return {{"LIBGL_ALWAYS_SOFTWARE", "1"},
          {"GALLIUM_DRIVER", "llvmpipe"},
          {"LP_NUM_THREADS", threads == 1 ? "0" : std::to_string(threads)},
          {"MESA_SHADER_CACHE_DISABLE", "true"},  // a study leaves nothing in the user's home
          // What would choose another driver or change what it does behind the study's back.
          {"MESA_LOADER_DRIVER_OVERRIDE", ""},
          {"LIBGL_ALWAYS_INDIRECT", ""},
          {"LP_DEBUG", ""},
          {"LP_PERF", ""},
          {"LP_NATIVE_VECTOR_WIDTH", ""}};
}

PictureBound llvmpipe_bound() {
  PictureBound bound(ModeBound{.vertex_unit = 0x1p-23,
                               .snap = 0x1p-9,
                               .edge_form = EdgeForm::kExact,
                               .edge_unit = 0,
                               .depth_unit = 0x1p-23});
  bound.geometry_unit = 0x1p-25;
  bound.depth_from_origin = true;
  return bound;
}

}  // namespace rasterbench
