// Compute programs.
#pragma once

#include <epoxy/gl.h>

#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/shader_source.h"

namespace drape::gl {

// Owns one linked compute program. Move-only; every call with its context current.
class Program {
 public:
  // INTERNAL (SHADER_COMPILE_FAILED) with the driver's log, places given as "file:line".
  static Result<Program> Compile(const ShaderSource& source);
  ~Program();
  Program(Program&& other) noexcept { *this = std::move(other); }
  Program& operator=(Program&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(uniform_locations_, other.uniform_locations_);
    return *this;
  }

  GLuint name() const { return name_; }
  void Use() const { glUseProgram(name_); }
  // For an unsigned integer; no effect where the compiler has removed the uniform.
  void SetUniform(GLint location, GLuint value) const;

 private:
  Program() = default;

  void FindUniforms();

  GLuint name_ = 0;
  std::vector<GLint> uniform_locations_;  // of the active ones
};

}  // namespace drape::gl
