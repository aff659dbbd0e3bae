// Compute and draw programs.
#pragma once

#include <epoxy/gl.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/gl/program_store.h"
#include "server/gl/shader_source.h"

namespace drape::gl {

// Owns one linked program. Move-only; its context must be current in every call.
class Program {
 public:
  // INTERNAL (SHADER_COMPILE_FAILED) with the driver's log, positions as "file:line".
  // What `store` has of it is loaded instead, and what it lacks is put there; null: neither.
  static Result<Program> Compile(const ShaderSource& source, const ProgramStore* store = nullptr);
  // A program of a vertex shader and a fragment shader; errors as Compile.
  static Result<Program> CompileDraw(const ShaderSource& vertex, const ShaderSource& fragment);
  ~Program();
  Program(Program&& other) noexcept { *this = std::move(other); }
  Program& operator=(Program&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(uniform_locations_, other.uniform_locations_);
    return *this;
  }

  GLuint name() const { return name_; }
  // What Load of the same driver takes.
  ProgramBinary binary() const;
  void Use() const { glUseProgram(name_); }
  // Sets an unsigned integer; no effect if the compiler has removed the uniform.
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
  // False: the driver refuses it.
  bool Load(const ProgramBinary& binary);

  GLuint name_ = 0;
  std::vector<GLint> uniform_locations_;  // of the active uniforms
};

}  // namespace drape::gl
