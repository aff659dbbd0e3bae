// Compute and draw programs.
#pragma once

#include <epoxy/gl.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/shader_source.h"

namespace drape::gl {

// Owns one linked program. Move-only; every call with its context current.
class Program {
 public:
  // INTERNAL (SHADER_COMPILE_FAILED) with the driver's log, places given as "file:line".
  static Result<Program> Compile(const ShaderSource& source);
  // The same for a vertex shader and a fragment shader.
  static Result<Program> CompileDraw(const ShaderSource& vertex, const ShaderSource& fragment);
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
  struct Stage {
    GLenum kind;
    const ShaderSource* source;
  };
  Program() = default;

  static Result<Program> Link(const std::string& name, std::span<const Stage> stages);
  Status Attach(const Stage& stage);
  void FindUniforms();

  GLuint name_ = 0;
  std::vector<GLint> uniform_locations_;  // of the active ones
};

}  // namespace drape::gl
