#include "server/gl/program.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <string>

namespace drape::gl {

namespace {

Status CompileError(const std::string& name, const char* action, const std::string& log) {
  const std::string message = name + " does not " + action + ": " + log;
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

Result<Program> Program::Compile(const ShaderSource& source, const ProgramStore* store) {
  if (store != nullptr) {
    Program program;
    const std::optional<ProgramBinary> known = store->Find(source.text);
    if (known && program.Load(*known)) return program;
  }
  const Stage stage{GL_COMPUTE_SHADER, &source};
  Result<Program> program = Link(source.name, std::span(&stage, 1));
  if (store != nullptr && program.ok()) store->Keep(source.text, program->binary());
  return program;
}

bool Program::Load(const ProgramBinary& binary) {
  name_ = glCreateProgram();
  glProgramBinary(name_, binary.format, binary.bytes.data(),
                  static_cast<GLsizei>(binary.bytes.size()));
  GLint is_ok = GL_FALSE;
  glGetProgramiv(name_, GL_LINK_STATUS, &is_ok);
  if (is_ok != GL_TRUE) return false;
  FindUniforms();
  return true;
}

ProgramBinary Program::binary() const {
  GLint size = 0;
  glGetProgramiv(name_, GL_PROGRAM_BINARY_LENGTH, &size);
  ProgramBinary binary;
  binary.bytes.resize(static_cast<size_t>(std::max(size, 0)));
  GLsizei length = 0;
  glGetProgramBinary(name_, size, &length, &binary.format, binary.bytes.data());
  binary.bytes.resize(static_cast<size_t>(std::max(length, 0)));
  return binary;
}

Result<Program> Program::CompileDraw(const ShaderSource& vertex, const ShaderSource& fragment) {
  const std::array stages = {Stage{GL_VERTEX_SHADER, &vertex},
                             Stage{GL_FRAGMENT_SHADER, &fragment}};
  return Link(vertex.name + " with " + fragment.name, stages);
}

Result<Program> Program::Link(const std::string& name, std::span<const Stage> stages) {
  Program program;
  program.name_ = glCreateProgram();
  for (const Stage& stage : stages) DRAPE_RETURN_IF_ERROR(program.Attach(stage));
  glProgramParameteri(program.name_, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
  glLinkProgram(program.name_);
  GLint is_ok = GL_FALSE;
  glGetProgramiv(program.name_, GL_LINK_STATUS, &is_ok);
  if (is_ok != GL_TRUE) {
    // With several stages the log does not say which file; with one stage it does.
    const std::vector<SourceLine> lines =
        stages.size() == 1 ? stages[0].source->lines : std::vector<SourceLine>();
    return CompileError(name, "link", WithFileNames(ProgramLog(program.name_), lines));
  }
  program.FindUniforms();
  return program;
}

// The shader exists as long as the program that it is attached to.
Status Program::Attach(const Stage& stage) {
  const GLuint shader = glCreateShader(stage.kind);
  const char* text = stage.source->text.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint is_ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &is_ok);
  Status status;
  if (is_ok == GL_TRUE) {
    glAttachShader(name_, shader);
  } else {
    status = CompileError(stage.source->name, "compile",
                          WithFileNames(ShaderLog(shader), stage.source->lines));
  }
  glDeleteShader(shader);
  return status;
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
  // OpenGL reports an error for an inactive location, but not for -1.
  if (std::find(uniform_locations_.begin(), uniform_locations_.end(), location) ==
      uniform_locations_.end()) {
    return;
  }
  glProgramUniform1ui(name_, location, value);
}

}  // namespace drape::gl
