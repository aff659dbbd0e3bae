// The shader files at the time of the build.
#pragma once

#include <span>
#include <string_view>

namespace drape {

struct EmbeddedShader {
  std::string_view path;  // relative to shaders/, "kernels/resident_step.comp"
  std::string_view text;
};

// Every file of interface/, lib/, stages/, kernels/ and draw/, sorted by path. Thread-safe.
std::span<const EmbeddedShader> EmbeddedShaders();

}  // namespace drape
