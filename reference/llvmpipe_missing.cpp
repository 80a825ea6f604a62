// In the place of llvmpipe.cpp where EGL and OpenGL were not found: says so.
#include "base/error.h"
#include "reference/llvmpipe.h"

namespace rasterbench {
namespace {
[[noreturn]] void refuse() { throw InputError({.field = kLlvmpipe}, llvmpipe_missing()); }
}  // namespace

bool has_llvmpipe() { return false; }
std::string llvmpipe_missing() { return "EGL and OpenGL were not found at build time"; }
LlvmpipeVersion llvmpipe_version() { refuse(); }
int observed_llvmpipe_threads() { refuse(); }
std::unique_ptr<Renderer> make_llvmpipe_renderer(const Scene&, const FrameSettings&) { refuse(); }

}  // namespace rasterbench
