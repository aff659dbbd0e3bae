// What the gl backend dispatches on the device of this process: texts of kernels, their uniforms,
// the storage blocks before and after.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/gl/shader_source.h"
#include "tests/emulator/work_groups.h"

namespace drape::emulator {

struct CapturedDispatch {
  std::string kernel;  // "resident_step"
  std::string glsl;
  std::vector<gl::SourceLine> lines;  // as in gl::ShaderSource
  Dispatch dispatch;                  // before
  Blocks after;
};

// While it exists, OpenGL's calls on this thread are watched, and storage without data is filled
// with kUnwritten. One at a time, made before the backend.
class Capture {
 public:
  Capture();
  ~Capture();
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  // Dispatches are kept from now on, or no longer.
  void Keep(bool keeps);
  std::vector<CapturedDispatch> Take();
};

}  // namespace drape::emulator
