#include "server/gl/debug_log.h"

#include <epoxy/gl.h>
#include <spdlog/spdlog.h>

namespace drape::gl {

namespace {

void APIENTRY LogMessage(GLenum source, GLenum type, GLuint id, GLenum severity, GLsizei /*length*/,
                         const GLchar* message, const void* /*user*/) {
  // Program::Compile reports compile errors with file names; Mesa gives compiler warnings a high
  // severity.
  if (source == GL_DEBUG_SOURCE_SHADER_COMPILER) {
    spdlog::debug("gl_compiler id={} message=\"{}\"", id, message);
  } else if (type == GL_DEBUG_TYPE_ERROR) {
    spdlog::error("gl_error id={} message=\"{}\"", id, message);
  } else if (severity == GL_DEBUG_SEVERITY_HIGH) {
    spdlog::warn("gl_message id={} message=\"{}\"", id, message);
  } else {
    spdlog::debug("gl_message id={} message=\"{}\"", id, message);
  }
}

}  // namespace

void EnableDebugLog() {
  glEnable(GL_DEBUG_OUTPUT);
  // Messages come inside the call that caused them, for which drivers give up to work on a thread
  // of their own: only for who looks for a cause. Otherwise on any thread, later.
  if (spdlog::should_log(spdlog::level::debug)) glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DEBUG_SEVERITY_NOTIFICATION, 0, nullptr,
                        GL_FALSE);
  glDebugMessageCallback(&LogMessage, nullptr);
}

}  // namespace drape::gl
