// The peer: the same triangles, camera, flat colours and depth test, drawn off screen by OpenGL on Mesa's
// llvmpipe, today's standard rasterizer on CPUs (https://docs.mesa3d.org/drivers/llvmpipe.html).
#pragma once

#include <map>
#include <memory>
#include <string>

#include "pipeline/frame.h"
#include "reference/double_renderer.h"

namespace rasterbench {

/// The peer's name in studies, records and lists.
inline constexpr const char* kLlvmpipe = "llvmpipe";

/// What this process's OpenGL says of itself.
struct LlvmpipeVersion {
  std::string renderer;  ///< GL_RENDERER: "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string version;   ///< GL_VERSION: "4.5 (Core Profile) Mesa 22.3.6"
};

/// Whether this build can draw with llvmpipe; if not, llvmpipe_missing() says why. If it can, the machine may
/// still have no llvmpipe: llvmpipe_version() says that.
bool has_llvmpipe();
std::string llvmpipe_missing();

/// The variables that make a process's OpenGL llvmpipe on `threads` threads. Mesa reads them once per
/// process. One thread is LP_NUM_THREADS=0: the application's own thread rasterizes; n > 1 are n threads that
/// rasterize beside the application's, which transforms and bins, as llvmpipe is built.
std::map<std::string, std::string> llvmpipe_variables(int threads);

/// Starts EGL and OpenGL. Throws InputError with the reason where the two are not there, or where they draw
/// with something else than llvmpipe.
LlvmpipeVersion llvmpipe_version();

/// Threads of this process that rasterize for llvmpipe: those that it has started, or the application's own.
int observed_llvmpipe_threads();

/// A renderer of `scene` in this process's llvmpipe. Triangles and their colours (shade_flat(), computed once
/// here, a flat vertex attribute) go into vertex buffers; a frame is clear, transform, draw and glFinish into
/// a framebuffer object of RGBA8 and 32-bit float depth. Its report has the whole frame under `raster`.
/// Reading back is outside of the frame. A triangle with a non-finite corner, of which OpenGL says nothing,
/// is uploaded as a point and draws nothing. ids() draws another frame, of the same vertices with the ids as
/// colours, and throws Error where its depths are not the first one's to the bit. The scene need not outlive
/// the renderer. Throws InputError where llvmpipe_version() does, for settings that OpenGL does not have (it
/// clips at the near plane, fills top-left, shows back faces, and the first of equal depths wins), and for
/// sizes that this llvmpipe does not hold.
std::unique_ptr<Renderer> make_llvmpipe_renderer(const Scene& scene, const FrameSettings& settings);

/// How far llvmpipe may stray from exact arithmetic on the file's values, in words, with its source.
extern const char* const kLlvmpipeBoundText;
extern const char* const kLlvmpipeBoundSource;

/// The same as numbers.
PictureBound llvmpipe_bound();

}  // namespace rasterbench
