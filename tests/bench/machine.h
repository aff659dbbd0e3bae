// The machine of a measurement.
#pragma once

#include <string>
#include <vector>

namespace drape::bench {

struct Machine {
  std::string cpu;  // of the first processor: ProcessorName
  unsigned cores = 0;
  std::vector<std::string> instruction_sets;  // those that matter here: sse4_2, avx2, fma, ...
  std::string compiler;
  std::string flags;
};

// The model name, with family and model where one name stands for many processors, as in virtual
// machines: "AMD EPYC" -> "AMD EPYC, family 25 model 17".
std::string ProcessorName(const std::string& name, const std::string& family,
                          const std::string& model);

// From /proc/cpuinfo and what the program was built with.
Machine DescribeMachine();

// Lower case, each run of anything but letters and digits one "-": "AMD EPYC" -> "amd-epyc".
std::string Slug(const std::string& text);

// "amd-epyc-2-cores", and "-" plus the renderer if a GPU was measured.
std::string MachineName(const Machine& machine, const std::string& gpu_renderer);

// The time now, "2026-01-31T12:00:00Z".
std::string UtcNow();

}  // namespace drape::bench
