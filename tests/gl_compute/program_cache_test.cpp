// Kernels that an earlier start has compiled.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

namespace fs = std::filesystem;

std::vector<float> FallingSheet(Backend& backend, uint32_t side) {
  const auto model = GridModel(side, side, {0});
  ParticleState state = AtRest(*model);
  for (uint32_t i = side; i < side * side; ++i) state.velocities_m_per_s[i].y() = std::sin(2.4 * i);
  const ClothHandle cloth = CreateCloth(backend, model, test::PlainParameters(), state);
  StepCloth(backend, cloth);
  std::vector<float> result = ReadCloth(backend, cloth);
  backend.Destroy(cloth);
  return result;
}

std::map<fs::path, fs::file_time_type> FilesOf(const fs::path& folder) {
  std::map<fs::path, fs::file_time_type> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    files[entry.path()] = entry.last_write_time();
  }
  return files;
}

TEST(ProgramCacheTest, TheNextStartLoadsThemAndHasTheSameBits) {
  const fs::path folder =
      fs::path(testing::TempDir()) / ("drape_program_cache_" + std::to_string(getpid()));
  const auto start = [&] {
    Result<std::unique_ptr<Backend>> backend =
        CreateGlBackend({.program_cache_dir = folder.string()});
    EXPECT_TRUE(backend.ok()) << backend.status().message();
    return std::move(backend).value();
  };
  const auto uncached = MakeGlBackend({});
  std::map<fs::path, fs::file_time_type> first;
  {
    const auto backend = start();
    for (const uint32_t side : {8u, 40u}) {  // resident, tiled
      EXPECT_EQ(FallingSheet(*backend, side), FallingSheet(*uncached, side));
    }
    first = FilesOf(folder);
    EXPECT_GT(first.size(), 10u) << "the general ones, a resident one, the tiled ones";
  }
  for (const auto& [path, time] : first) {
    fs::last_write_time(path, time - std::chrono::hours(1));
  }
  {
    const auto backend = start();
    for (const uint32_t side : {8u, 40u}) {
      EXPECT_EQ(FallingSheet(*backend, side), FallingSheet(*uncached, side));
    }
  }
  const auto second = FilesOf(folder);
  EXPECT_EQ(second.size(), first.size());
  for (const auto& [path, time] : second) {
    EXPECT_GT(time, first[path] - std::chrono::hours(1)) << "not used: " << path;
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace drape
