// drape_fuzz --target=NAME [libFuzzer's arguments]: searches inputs of one target that reach more
// of the code, and those that fail. --write-seeds=FOLDER writes the good inputs to begin with.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/fuzz/targets/targets.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace {

const drape::test::FuzzTarget* chosen = nullptr;

void WriteSeeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  int number = 0;
  for (const std::string& seed : chosen->seeds()) {
    std::ofstream(folder / ("seed-" + std::to_string(number++)), std::ios::binary) << seed;
  }
}

[[noreturn]] void ExplainAndExit() {
  std::fprintf(stderr, "drape_fuzz --target=NAME [--write-seeds=FOLDER]; targets:\n");
  for (const auto& target : drape::test::FuzzTargets()) {
    std::fprintf(stderr, "  %s\n", target.name.c_str());
  }
  std::exit(2);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kTarget = "--target=", kSeeds = "--write-seeds=";
  std::string folder;
  for (int k = 1; k < *argc; ++k) {
    const std::string_view word = (*argv)[k];
    if (word.starts_with(kTarget)) {
      chosen = drape::test::FindFuzzTarget(word.substr(kTarget.size()));
    }
    if (word.starts_with(kSeeds)) folder = word.substr(kSeeds.size());
  }
  if (chosen == nullptr) ExplainAndExit();
  if (!folder.empty()) {
    WriteSeeds(folder);
    std::exit(0);
  }
  chosen->seeds();  // what they need is made before the search, not within its first input
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}

// Half of the changes keep the form, where there is one.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  if (chosen->mutate && seed % 2 == 0) {
    const std::string changed =
        chosen->mutate({reinterpret_cast<const char*>(data), size}, seed / 2);
    if (!changed.empty() && changed.size() <= max_size) {
      changed.copy(reinterpret_cast<char*>(data), changed.size());
      return changed.size();
    }
  }
  return LLVMFuzzerMutate(data, size, max_size);
}
