#include "tests/emulator/capture.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "server/core/check.h"
#include "server/solver/gl_compute/kernels.h"

namespace drape::emulator {

namespace {

// The driver's own functions: those of epoxy find themselves at their first call.
template <class Function>
Function Find(const char* name) {
  auto function = reinterpret_cast<Function>(eglGetProcAddress(name));
  DRAPE_CHECK(function != nullptr, name);
  return function;
}

struct Watch {
  std::map<GLuint, std::string> texts;     // by shader
  std::map<GLuint, std::string> programs;  // by program
  bool keeps = false;
  std::vector<CapturedDispatch> kept;
};
Watch* watch = nullptr;

std::vector<uint32_t> ContentsOf(GLuint buffer) {
  GLint64 bytes = 0;
  glGetNamedBufferParameteri64v(buffer, GL_BUFFER_SIZE, &bytes);
  std::vector<uint32_t> words(static_cast<size_t>(bytes) / 4);
  glGetNamedBufferSubData(buffer, 0, static_cast<GLsizeiptr>(words.size() * 4), words.data());
  return words;
}

Blocks BoundBlocks() {
  Blocks blocks;
  for (GLuint binding = 0; binding < kBindings; ++binding) {
    GLint buffer = 0;
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, binding, &buffer);
    if (buffer != 0) blocks[binding] = ContentsOf(static_cast<GLuint>(buffer));
  }
  return blocks;
}

std::array<uint32_t, kUniforms> UniformsOf(GLuint program) {
  std::array<uint32_t, kUniforms> values{};
  GLint count = 0;
  glGetProgramInterfaceiv(program, GL_UNIFORM, GL_ACTIVE_RESOURCES, &count);
  for (GLint index = 0; index < count; ++index) {
    const GLenum property = GL_LOCATION;
    GLint location = -1;
    glGetProgramResourceiv(program, GL_UNIFORM, static_cast<GLuint>(index), 1, &property, 1,
                           nullptr, &location);
    if (location >= 0) {
      glGetUniformuiv(program, location, &values.at(static_cast<size_t>(location)));
    }
  }
  return values;
}

// Each kernel as assembled without defines: the end of every text made of it.
const std::map<std::string, gl::ShaderSource>& PlainKernels() {
  static const auto& kernels = *new std::map<std::string, gl::ShaderSource>([] {
    std::map<std::string, gl::ShaderSource> plain;
    const Result<gl::ShaderLibrary> library = OpenShaders("");
    DRAPE_CHECK(library.ok(), library.status().ToString());
    std::vector<std::string> names = {
        "resident_step",   "measure_start",  "measure_pieces", "measure_total",
        "measure_strains", "impulses_begin", "impulses_total", "pack"};
    for (const TiledKernel& kernel : TiledKernels()) names.emplace_back(kernel.file);
    for (const std::string& name : names) {
      const Result<gl::ShaderSource> source = AssembleKernel(library.value(), name, "");
      DRAPE_CHECK(source.ok(), source.status().ToString());
      plain[name] = source.value();
    }
    return plain;
  }());
  return kernels;
}

// Line k of `glsl` is line k of the plain kernel, counted from the end.
void FindOrigin(CapturedDispatch& captured) {
  for (const auto& [name, plain] : PlainKernels()) {
    const size_t first_file = plain.text.find("\n// ");  // after the defines of all kernels
    if (!captured.glsl.ends_with(std::string_view(plain.text).substr(first_file))) continue;
    const auto line_count =
        static_cast<size_t>(std::count(captured.glsl.begin(), captured.glsl.end(), '\n'));
    captured.kernel = name;
    captured.lines.assign(line_count, {"defines", 1});
    const size_t same = std::min(line_count, plain.lines.size());
    std::copy_backward(plain.lines.end() - static_cast<std::ptrdiff_t>(same), plain.lines.end(),
                       captured.lines.end());
    return;
  }
  DRAPE_CHECK(false, "no kernel of this text:\n" + captured.glsl);
}

template <class DispatchCall>
void KeepDispatch(const std::array<uint32_t, 3>& group_count, const DispatchCall& dispatch) {
  if (!watch->keeps) {
    dispatch();
    return;
  }
  GLint program = 0;
  glGetIntegerv(GL_CURRENT_PROGRAM, &program);
  CapturedDispatch captured;
  captured.glsl = watch->programs.at(static_cast<GLuint>(program));
  FindOrigin(captured);
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  captured.dispatch = {.group_count = group_count,
                       .uniforms = UniformsOf(static_cast<GLuint>(program)),
                       .blocks = BoundBlocks()};
  dispatch();
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  captured.after = BoundBlocks();
  watch->kept.push_back(std::move(captured));
}

void WatchedDispatch(GLuint x, GLuint y, GLuint z) {
  static const auto real = Find<PFNGLDISPATCHCOMPUTEPROC>("glDispatchCompute");
  KeepDispatch({x, y, z}, [&] { real(x, y, z); });
}

void WatchedIndirect(GLintptr offset) {
  static const auto real = Find<PFNGLDISPATCHCOMPUTEINDIRECTPROC>("glDispatchComputeIndirect");
  std::array<uint32_t, 3> group_count{};
  if (watch->keeps) {
    GLint buffer = 0;
    glGetIntegerv(GL_DISPATCH_INDIRECT_BUFFER_BINDING, &buffer);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    glGetNamedBufferSubData(static_cast<GLuint>(buffer), offset, sizeof(group_count),
                            group_count.data());
  }
  KeepDispatch(group_count, [&] { real(offset); });
}

void WatchedSource(GLuint shader, GLsizei count, const GLchar* const* strings,
                   const GLint* lengths) {
  static const auto real = Find<PFNGLSHADERSOURCEPROC>("glShaderSource");
  std::string& text = watch->texts[shader];
  text.clear();
  for (GLsizei k = 0; k < count; ++k) text += strings[k];
  real(shader, count, strings, lengths);
}

void WatchedAttach(GLuint program, GLuint shader) {
  static const auto real = Find<PFNGLATTACHSHADERPROC>("glAttachShader");
  watch->programs[program] = watch->texts[shader];
  real(program, shader);
}

void WatchedStorage(GLuint buffer, GLsizeiptr bytes, const void* data, GLbitfield flags) {
  static const auto real = Find<PFNGLNAMEDBUFFERSTORAGEPROC>("glNamedBufferStorage");
  const std::vector<uint32_t> garbage(data == nullptr ? static_cast<size_t>(bytes + 3) / 4 : 0,
                                      kUnwritten);
  real(buffer, bytes, data == nullptr ? garbage.data() : data, flags);
}

// epoxy calls through these; the first call of the usual one finds the driver's.
struct Calls {
  PFNGLDISPATCHCOMPUTEPROC dispatch = glDispatchCompute;
  PFNGLDISPATCHCOMPUTEINDIRECTPROC indirect = glDispatchComputeIndirect;
  PFNGLSHADERSOURCEPROC source = glShaderSource;
  PFNGLATTACHSHADERPROC attach = glAttachShader;
  PFNGLNAMEDBUFFERSTORAGEPROC storage = glNamedBufferStorage;

  void Install() const {
    glDispatchCompute = dispatch;
    glDispatchComputeIndirect = indirect;
    glShaderSource = source;
    glAttachShader = attach;
    glNamedBufferStorage = storage;
  }
};
Calls usual;

}  // namespace

Capture::Capture() {
  DRAPE_CHECK(watch == nullptr, "one capture at a time");
  watch = new Watch;
  usual = Calls();
  Calls{WatchedDispatch, WatchedIndirect, WatchedSource, WatchedAttach, WatchedStorage}.Install();
}

Capture::~Capture() {
  usual.Install();
  delete watch;
  watch = nullptr;
}

void Capture::Keep(bool keeps) {
  watch->keeps = keeps;
}

std::vector<CapturedDispatch> Capture::Take() {
  return std::exchange(watch->kept, {});
}

}  // namespace drape::emulator
