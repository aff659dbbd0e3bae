#include "tests/bench/machine.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <fstream>
#include <sstream>
#include <thread>

namespace drape::bench {
namespace {

// The value of the first line "key : value" of /proc/cpuinfo, or "".
std::string CpuInfo(const std::string& key) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(key, 0) != 0) continue;
    const size_t colon = line.find(": ");
    if (colon != std::string::npos) return line.substr(colon + 2);
  }
  return "";
}

}  // namespace

std::string ProcessorName(const std::string& name, const std::string& family,
                          const std::string& model) {
  if (name.empty()) return "unknown processor";
  const bool has_number = std::any_of(name.begin(), name.end(), [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0;
  });
  if (has_number || family.empty() || model.empty()) return name;
  return name + ", family " + family + " model " + model;
}

Machine DescribeMachine() {
  Machine machine;
  machine.cpu = ProcessorName(CpuInfo("model name"), CpuInfo("cpu family"), CpuInfo("model\t"));
  machine.cores = std::thread::hardware_concurrency();
  std::istringstream flags(CpuInfo("flags"));
  for (std::string flag; flags >> flag;) {
    for (const char* known : {"sse4_2", "avx", "avx2", "fma", "avx512f", "avx512vl"}) {
      if (flag == known) machine.instruction_sets.push_back(flag);
    }
  }
#ifdef __clang__
  machine.compiler = __VERSION__;
#else
  machine.compiler = std::string("GCC ") + __VERSION__;
#endif
  machine.flags = DRAPE_BENCH_FLAGS;
  return machine;
}

std::string Slug(const std::string& text) {
  std::string slug;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte)) {
      slug += static_cast<char>(std::tolower(byte));
    } else if (!slug.empty() && slug.back() != '-') {
      slug += '-';
    }
  }
  while (!slug.empty() && slug.back() == '-') slug.pop_back();
  return slug;
}

std::string MachineName(const Machine& machine, const std::string& gpu_renderer) {
  const std::string cores =
      std::to_string(machine.cores) + (machine.cores == 1 ? " core" : " cores");
  return Slug(machine.cpu + " " + cores + " " + gpu_renderer);
}

std::string UtcNow() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace drape::bench
