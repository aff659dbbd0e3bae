// A kernel as C++ code that runs here: translated (translate.py), compiled by the compiler of this
// build, loaded. Kernels are kept in the build folder by a hash of all that goes into them.
#pragma once

#include <string>
#include <vector>

#include "server/gl/shader_source.h"
#include "tests/emulator/findings.h"
#include "tests/emulator/kernel_interface.h"

namespace drape::emulator {

class CompiledKernel {
 public:
  // `lines`: the origin of each line of `glsl`; or empty. Ends the process with the compiler's
  // words if it fails. Kernels that differ in their LOCAL_SIZE alone are one. Once loaded it stays
  // so until the process ends.
  static const CompiledKernel& Load(const std::string& glsl,
                                    const std::vector<gl::SourceLine>& lines);

  const KernelEntry& entry() const { return *entry_; }
  // One line each: what is wrong, and where in the shaders.
  std::string Describe(const Findings& findings) const;
  // "stages/tether.glsl:20".
  std::string LineOf(const void* place) const;

 private:
  std::string path_;
  const std::byte* base_ = nullptr;
  const KernelEntry* entry_ = nullptr;
};

// The text with this #define before its own.
std::string WithDefine(const std::string& glsl, const std::string& name);
// The number that the text defines as LOCAL_SIZE.
uint32_t LocalSizeOf(const std::string& glsl);

}  // namespace drape::emulator
