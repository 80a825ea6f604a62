#include "kernels/kernel.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/suggest.h"

namespace rasterbench {
namespace {

std::vector<Kernel>& registry() {
  static std::vector<Kernel> all;
  return all;
}

}  // namespace

const Kernel::Variant& Kernel::variant(std::string_view mode) const {
  for (const Variant& v : variants_)
    if (v.mode == mode) return v;
  std::vector<std::string> known;
  for (const Variant& v : variants_) known.emplace_back(v.mode);
  throw InputError({.field = "numeric"}, unknown_name("numeric mode", mode, known));
}

std::span<const Kernel> kernels() { return registry(); }

const Kernel& find_kernel(std::string_view name) {
  std::vector<std::string> known;
  for (const Kernel& kernel : registry()) {
    if (kernel.info().name == name) return kernel;
    if (!kernel.info().hidden) known.emplace_back(kernel.info().name);
  }
  throw InputError({.field = "kernel"}, unknown_name("kernel", name, known));
}

std::unique_ptr<Renderer> make_renderer(std::string_view kernel, std::string_view mode,
                                        const RendererSetup& setup) {
  const Kernel::Variant& variant = find_kernel(kernel).variant(mode);
  if (!variant.make)
    throw InputError({.field = "kernel"},
                     fmt::format("{} cannot run in mode {}: {}", kernel, mode, variant.reason));
  return variant.make(setup);
}

void register_kernel(Kernel kernel) { registry().push_back(std::move(kernel)); }

}  // namespace rasterbench
