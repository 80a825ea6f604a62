// The only file that is compiled against EGL and OpenGL. Where they are not found, llvmpipe_missing.cpp takes
// its place.
//
// The context is off screen and without a surface: EGL_MESA_platform_surfaceless,
// https://registry.khronos.org/EGL/extensions/MESA/EGL_MESA_platform_surfaceless.txt.
#include "reference/llvmpipe.h"

#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>

#include "base/error.h"
#include "pipeline/resolve.h"

namespace rasterbench {
namespace {

constexpr std::size_t kCorners = 3;

constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 colour;
uniform mat4 world_to_clip;
flat out vec4 flat_colour;
void main() {
  gl_Position = world_to_clip * vec4(position, 1.0);
  flat_colour = colour;
}
)";

constexpr const char* kFragmentShader = R"(#version 330 core
flat in vec4 flat_colour;
out vec4 colour;
void main() { colour = flat_colour; }
)";

[[noreturn]] void refuse(const std::string& reason) { throw InputError({.field = kLlvmpipe}, reason); }

std::string gl_text(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text ? reinterpret_cast<const char*>(text) : "";
}

/// An OpenGL 3.3 core context without a surface, on llvmpipe.
class Context {
 public:
  Context() {
    // One display for the process, which owns llvmpipe's threads; it is never terminated, because that would
    // take it from other contexts.
    display_ = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr))
      refuse(fmt::format("EGL has no surfaceless display (EGL_MESA_platform_surfaceless): error {:#x}",
                         eglGetError()));
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_DONT_CARE, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint found = 0;
    if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(display_, wanted, &config, 1, &found) || found == 0)
      refuse(fmt::format("EGL has no OpenGL: error {:#x}", eglGetError()));
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 3,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 3,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes);
    if (context_ == EGL_NO_CONTEXT)
      refuse(fmt::format("EGL makes no OpenGL 3.3 core context: error {:#x}", eglGetError()));
    make_current();
    version_ = {gl_text(GL_RENDERER), gl_text(GL_VERSION)};
    if (version_.renderer.find("llvmpipe") == std::string::npos) {
      destroy();
      refuse(fmt::format("OpenGL draws with '{}', which is not llvmpipe", version_.renderer));
    }
  }
  ~Context() { destroy(); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  void make_current() const {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      throw Error(fmt::format("EGL cannot make its context current: error {:#x}", eglGetError()));
  }
  const LlvmpipeVersion& version() const { return version_; }

 private:
  // With the context goes all that was made in it.
  void destroy() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  LlvmpipeVersion version_;
};

void check_gl(const char* what) {
  const GLenum error = glGetError();
  if (error == GL_OUT_OF_MEMORY) refuse(fmt::format("{} does not fit into OpenGL's memory", what));
  if (error != GL_NO_ERROR) throw Error(fmt::format("OpenGL: {}: error {:#x}", what, error));
}

GLuint compiled(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::array<char, 1024> log{};
    glGetShaderInfoLog(shader, log.size(), nullptr, log.data());
    throw Error(fmt::format("OpenGL: a shader does not compile: {}", log.data()));
  }
  return shader;
}

GLuint linked_program() {
  const GLuint program = glCreateProgram();
  glAttachShader(program, compiled(GL_VERTEX_SHADER, kVertexShader));
  glAttachShader(program, compiled(GL_FRAGMENT_SHADER, kFragmentShader));
  glLinkProgram(program);
  GLint ok = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &ok);
  if (!ok) throw Error("OpenGL: the program does not link");
  return program;
}

/// The rows of the camera in float32, in OpenGL's y: its row 0 is at the bottom and ours on top, so y points
/// down in clip space, which is exact, and llvmpipe's top and left are those of our picture.
std::array<float, 16> clip_matrix(const Camera& camera) {
  std::array<float, 16> matrix{};
  std::size_t i = 0;
  for (const auto& [row, sign] :
       {std::pair{camera.x, 1.0}, {camera.y, -1.0}, {camera.z, 1.0}, {camera.w, 1.0}})
    for (const double coefficient : {row.x, row.y, row.z, row.w})
      matrix[i++] = static_cast<float>(sign * coefficient);
  return matrix;
}

bool is_finite(const Triangle& t) {
  return std::ranges::all_of(std::array{t.a, t.b, t.c}, [](const Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  });
}

/// A framebuffer object and its two renderbuffers.
struct Framebuffer {
  GLuint name = 0;
  std::array<GLuint, 2> attachments{};
};

/// Of the picture's size; bound and complete, or InputError.
Framebuffer make_framebuffer(GLsizei width, GLsizei height) {
  Framebuffer framebuffer;
  auto& attachments = framebuffer.attachments;
  glGenFramebuffers(1, &framebuffer.name);
  glGenRenderbuffers(2, attachments.data());
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name);
  const std::array<std::pair<GLenum, GLenum>, 2> formats{
      {{GL_RGBA8, GL_COLOR_ATTACHMENT0}, {GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT}}};
  for (std::size_t i = 0; i < formats.size(); ++i) {
    glBindRenderbuffer(GL_RENDERBUFFER, attachments[i]);
    glRenderbufferStorage(GL_RENDERBUFFER, formats[i].first, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, formats[i].second, GL_RENDERBUFFER, attachments[i]);
  }
  check_gl("the framebuffer");
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    refuse(fmt::format("no framebuffer of {}x{} with RGBA8 and 32-bit float depth", width, height));
  return framebuffer;
}

void delete_framebuffer(const Framebuffer& framebuffer) {
  glDeleteFramebuffers(1, &framebuffer.name);
  glDeleteRenderbuffers(2, framebuffer.attachments.data());
}

/// A vertex buffer of `colours`, one a triangle, as the flat attribute of its three corners.
GLuint upload_colours(const std::vector<std::uint32_t>& colours) {
  std::vector<std::uint32_t> corners;
  corners.reserve(colours.size() * kCorners);
  for (const std::uint32_t colour : colours) corners.insert(corners.end(), kCorners, colour);
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(std::uint32_t)),
               corners.data(), GL_STATIC_DRAW);
  check_gl("the colours");
  return buffer;
}

class LlvmpipeRenderer final : public Renderer {
 public:
  LlvmpipeRenderer(const Scene& scene, const FrameSettings& settings)
      : width_(settings.width),
        height_(settings.height),
        pixels_(settings.pixels()),
        triangles_(scene.model.triangles.size()) {
    if (settings.fill != FillRule::kTopLeft || settings.tie != TieRule::kFirst ||
        settings.geometry.near_rule != NearRule::kClip || settings.geometry.cull_back_faces)
      refuse(
          "OpenGL fills top-left, lets the first of equal depths win, clips at the near plane and here "
          "culls nothing");
    if (triangles_ > std::numeric_limits<GLsizei>::max() / kCorners)
      refuse(
          fmt::format("OpenGL draws up to 2^31 - 1 vertices at once, not those of {} triangles", triangles_));
    GLint most = 0;
    glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &most);
    if (std::max(width_, height_) > most)
      refuse(fmt::format("this llvmpipe draws pictures of up to {} pixels a side", most));

    const GLuint program = linked_program();
    glUseProgram(program);
    const std::array<float, 16> matrix = clip_matrix(sized_camera(scene, settings));
    glUniformMatrix4fv(glGetUniformLocation(program, "world_to_clip"), 1, GL_TRUE, matrix.data());
    framebuffer_ = make_framebuffer(width_, height_).name;
    upload(scene);
    glViewport(0, 0, width_, height_);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DITHER);  // on by default
    check_gl("the set-up");
    background_ = pack_rgba(scene.parameters.background);
  }

  const FrameReport& draw() override {
    context_.make_current();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    is_read_ = false;
    const auto begin = std::chrono::steady_clock::now();
    draw_triangles(background_);
    report_.seconds.raster = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    report_.counts.triangles = static_cast<std::int64_t>(triangles_);
    check_gl("a frame");
    return report_;
  }

  std::span<const std::uint32_t> colours() const override {
    read_back();
    return colours_;
  }
  std::span<const float> depths() const override {
    read_back();
    return depths_;
  }

  std::vector<std::int32_t> ids() const override {
    read_back();
    const Framebuffer framebuffer = make_framebuffer(width_, height_);
    std::vector<std::uint32_t> codes(triangles_);  // id + 1, all 32 bits of RGBA8; 0 is the background
    for (std::size_t i = 0; i < triangles_; ++i) codes[i] = static_cast<std::uint32_t>(i) + 1;
    const GLuint buffer = upload_colours(codes);
    bind_colours(buffer);
    draw_triangles(0);
    const std::vector<std::uint32_t> found = read_colours();
    const bool same = std::ranges::equal(read_depths(), window_depths_);
    bind_colours(colour_buffer_);
    glDeleteBuffers(1, &buffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    delete_framebuffer(framebuffer);
    check_gl("the picture of ids");
    if (!same) throw Error("llvmpipe: the picture of ids has other depths than the frame");
    std::vector<std::int32_t> ids(pixels_);
    for (std::size_t i = 0; i < pixels_; ++i) {
      if (found[i] > triangles_) throw Error(fmt::format("llvmpipe: id {} is no triangle's", found[i] - 1));
      ids[i] = static_cast<std::int32_t>(found[i]) - 1;
    }
    return ids;
  }

  std::vector<double> values() const override {
    read_back();
    std::vector<double> values(pixels_);
    std::ranges::transform(window_depths_, values.begin(), [](float z) { return 2 * double{z} - 1; });
    return values;
  }

  /// Of the vertex buffers and the framebuffer; what llvmpipe needs besides, its bins, is not known.
  std::size_t bytes() const override {
    return triangles_ * (sizeof(Triangle) + kCorners * sizeof(std::uint32_t)) +
           pixels_ * (sizeof(std::uint32_t) + sizeof(float));
  }

 private:
  void upload(const Scene& scene) {
    const auto& triangles = scene.model.triangles;
    std::vector<std::uint32_t> colours(triangles_);
    for (std::size_t i = 0; i < triangles_; ++i)
      colours[i] = shade_flat(triangles[i], scene.parameters.object);
    GLuint vertices = 0, positions = 0;
    glGenVertexArrays(1, &vertices);
    glBindVertexArray(vertices);
    glGenBuffers(1, &positions);
    glBindBuffer(GL_ARRAY_BUFFER, positions);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles_ * sizeof(Triangle)), triangles.data(),
                 GL_STATIC_DRAW);
    check_gl("the triangles");
    constexpr Triangle kPoint{};
    for (std::size_t i = 0; i < triangles_; ++i)
      if (!is_finite(triangles[i]))
        glBufferSubData(GL_ARRAY_BUFFER, static_cast<GLintptr>(i * sizeof(Triangle)), sizeof(Triangle),
                        &kPoint);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vec3), nullptr);
    colour_buffer_ = upload_colours(colours);
    bind_colours(colour_buffer_);
  }

  static void bind_colours(GLuint buffer) {
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(std::uint32_t), nullptr);
  }

  void draw_triangles(std::uint32_t background) const {
    const auto channel = [&](int i) { return static_cast<float>(background >> (8 * i) & 0xff) / 255.0f; };
    glClearColor(channel(0), channel(1), channel(2), channel(3));
    glClearDepth(1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(triangles_ * kCorners));
    glFinish();
  }

  std::vector<std::uint32_t> read_colours() const {
    std::vector<std::uint32_t> colours(pixels_);
    glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, colours.data());
    return colours;
  }
  std::vector<float> read_depths() const {
    std::vector<float> depths(pixels_);
    glReadPixels(0, 0, width_, height_, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
    return depths;
  }

  /// What the last frame left in the framebuffer; once a frame.
  void read_back() const {
    context_.make_current();
    if (is_read_) return;
    colours_ = read_colours();
    window_depths_ = read_depths();
    check_gl("reading back");
    depths_.resize(pixels_);
    // OpenGL's default depth range: z = (d + 1) / 2.
    std::ranges::transform(window_depths_, depths_.begin(), [](float z) { return 2 * z - 1; });
    is_read_ = true;
  }

  Context context_;
  GLsizei width_, height_;
  std::size_t pixels_, triangles_;
  GLuint framebuffer_ = 0, colour_buffer_ = 0;
  std::uint32_t background_ = 0;
  FrameReport report_;
  mutable bool is_read_ = false;
  mutable std::vector<std::uint32_t> colours_;
  mutable std::vector<float> depths_, window_depths_;
};

}  // namespace

bool has_llvmpipe() { return true; }
std::string llvmpipe_missing() { return {}; }

LlvmpipeVersion llvmpipe_version() { return Context().version(); }

int observed_llvmpipe_threads() {
  int count = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(task.path() / "comm");  // a thread may have ended meanwhile: then it is none of those
    std::string name;
    if (std::getline(file, name) && name.starts_with("llvmpipe-")) ++count;
  }
  return std::max(count, 1);
}

std::unique_ptr<Renderer> make_llvmpipe_renderer(const Scene& scene, const FrameSettings& settings) {
  return std::make_unique<LlvmpipeRenderer>(scene, settings);
}

}  // namespace rasterbench
