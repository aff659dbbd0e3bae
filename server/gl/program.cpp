#include "server/gl/program.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <string>

namespace drape::gl {

namespace {

Status CompileError(const ShaderSource& source, const char* action, const std::string& log) {
  const std::string message =
      source.name + " does not " + action + ": " + WithFileNames(log, source.lines);
  spdlog::error("shader_{}_failed {}", action, message);
  return Status(StatusCode::kInternal, "SHADER_COMPILE_FAILED", message);
}

std::string ShaderLog(GLuint shader) {
  GLint size = 0;
  glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &size);
  std::string log(static_cast<size_t>(size), '\0');
  GLsizei length = 0;
  glGetShaderInfoLog(shader, size, &length, log.data());
  log.resize(static_cast<size_t>(length));
  return log;
}

std::string ProgramLog(GLuint program) {
  GLint size = 0;
  glGetProgramiv(program, GL_INFO_LOG_LENGTH, &size);
  std::string log(static_cast<size_t>(size), '\0');
  GLsizei length = 0;
  glGetProgramInfoLog(program, size, &length, log.data());
  log.resize(static_cast<size_t>(length));
  return log;
}

}  // namespace

Result<Program> Program::Compile(const ShaderSource& source) {
  const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
  const char* text = source.text.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint is_ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &is_ok);
  if (is_ok != GL_TRUE) {
    Status error = CompileError(source, "compile", ShaderLog(shader));
    glDeleteShader(shader);
    return error;
  }
  Program program;
  program.name_ = glCreateProgram();
  glAttachShader(program.name_, shader);
  glLinkProgram(program.name_);
  glDetachShader(program.name_, shader);
  glDeleteShader(shader);
  glGetProgramiv(program.name_, GL_LINK_STATUS, &is_ok);
  if (is_ok != GL_TRUE) return CompileError(source, "link", ProgramLog(program.name_));
  program.FindUniforms();
  return program;
}

void Program::FindUniforms() {
  GLint count = 0;
  glGetProgramInterfaceiv(name_, GL_UNIFORM, GL_ACTIVE_RESOURCES, &count);
  for (GLint index = 0; index < count; ++index) {
    const GLenum property = GL_LOCATION;
    GLint location = -1;
    glGetProgramResourceiv(name_, GL_UNIFORM, static_cast<GLuint>(index), 1, &property, 1, nullptr,
                           &location);
    uniform_locations_.push_back(location);
  }
}

Program::~Program() {
  if (name_ != 0) glDeleteProgram(name_);
}

void Program::SetUniform(GLint location, GLuint value) const {
  // An inactive location is an error of OpenGL, unlike location -1.
  if (std::find(uniform_locations_.begin(), uniform_locations_.end(), location) ==
      uniform_locations_.end()) {
    return;
  }
  glProgramUniform1ui(name_, location, value);
}

}  // namespace drape::gl
