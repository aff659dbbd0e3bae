// `drape_bench kernels`: the kernels of named cloths as a GPU's driver gets them, for tools that
// count what they cost without a GPU.
#pragma once

#include <filesystem>
#include <string>

namespace drape::bench {

struct KernelsOptions {
  std::filesystem::path dump;  // folder; must be set
  std::string shader_dir;      // whose files replace the built-in shaders; empty: none
};

// Writes each program once into a file of its own, assembled and specialised as for a GPU, and the
// list kernels.json: the programs, and the sizes of the cloth of each, from which follows how often
// its loops run. std::runtime_error if the folder cannot be written or `shader_dir` not be used.
void DumpKernels(const KernelsOptions& options);

}  // namespace drape::bench
