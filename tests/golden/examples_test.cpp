// The scene files of client/examples, played through the server: the states that clients read have
// the bits that are recorded in tests/golden/states.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "drape/client.h"
#include "drape/scene_file.h"
#include "drape/scene_player.h"
#include "tests/golden/golden_rows.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

struct Width {
  std::string file;     // the rows' file is named after it
  std::string backend;  // of the server
  uint32_t copies;      // of the whole scene, all different
  uint32_t short_steps;
  uint64_t long_part;  // the long tier plays the scene for steps / long_part
};

void PrintTo(const Width& width, std::ostream* stream) {
  *stream << width.file;
}

std::vector<std::filesystem::path> SceneFiles() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("client/examples"))) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Copies of the scene, each under another gravity.
v1::Scene LoadCopies(const std::filesystem::path& file, uint32_t copies) {
  v1::Scene all = LoadScene(file);
  const auto cloth_count = static_cast<uint32_t>(ClothCount(all));
  if (cloth_count >= copies) return all;
  for (uint32_t copy = 0; copy < copies; ++copy) {
    const std::string y = std::to_string(-9.81 + 0.01 * copy);
    v1::Scene scene = LoadScene(file, std::vector{"environment.gravity_m_per_s2=[0," + y + ",0]"});
    for (v1::SceneCloth& cloth : *scene.mutable_cloths()) {
      if (!cloth.world().empty()) cloth.set_world(cloth.world() + std::to_string(copy));
    }
    for (v1::SceneControl& control : *scene.mutable_controls()) {
      for (uint32_t& cloth : *control.mutable_cloths()) cloth += copy * cloth_count;
    }
    if (copy == 0) all = v1::Scene();
    all.MergeFrom(scene);
  }
  return all;
}

std::string BytesOf(v1::StepReport report) {
  report.clear_cloth_id();  // says which slot of the server it has
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  report.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

void Add(const VectorView& vectors, StateHash& hash) {
  const auto add = [&](auto values) {
    hash.Add({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  };
  add(vectors.floats());
  add(vectors.doubles());
}

std::string PlayAndHash(const Client& client, const v1::Scene& scene, uint64_t steps) {
  Session session = client.CreateSession();
  ScenePlayer player(session, scene, client.GetServerInfo().limits());
  StateHash hash;
  const AdvanceResult result = player.Advance(steps, /*has_reports=*/true);
  for (const v1::StepReport& report : result.reports) hash.Add(BytesOf(report));
  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  for (const ClothState& state : session.ReadStates(view)) {
    Add(state.positions_m, hash);
    Add(state.velocities_m_per_s, hash);
  }
  return hash.Text();
}

class GoldenExamplesTest : public testing::TestWithParam<Width> {};
class GoldenExamplesLong : public testing::TestWithParam<Width> {};
const Width kReference{"reference", "reference", 1, 3, 10};
const Width kCpu{"cpu", "cpu", 1, 12, 1};
const Width kCpuSideBySide{"cpu_side_by_side", "cpu", 6, 3, 2};
const Width kGl{"gl", "gl", 1, 0, 20};  // long tier only
INSTANTIATE_TEST_SUITE_P(Widths, GoldenExamplesTest,
                         testing::Values(kReference, kCpu, kCpuSideBySide),
                         [](const auto& one) { return one.param.file; });
INSTANTIATE_TEST_SUITE_P(Widths, GoldenExamplesLong, testing::Values(kReference, kCpu, kGl),
                         [](const auto& one) { return one.param.file; });

// Worlds, bodies, and what edges and triangles touch are for cpu on gl, too (PairBackends); the
// kernels for cloths that touch themselves, which take long to compile, have tests of their own
// (tests/gl_compute, tests/physics).
bool IsForGl(const v1::Scene& scene) {
  return std::ranges::all_of(scene.cloths(), [](const v1::SceneCloth& cloth) {
    const auto& colliders = cloth.spec().environment().colliders();
    return cloth.world().empty() && !cloth.spec().has_self_collision() &&
           cloth.spec().settings().collider_contact() != v1::StepSettings::SURFACE &&
           std::ranges::none_of(colliders, [](const v1::Collider& collider) {
             return collider.has_mass_kg() || collider.has_density_kg_per_m3();
           });
  });
}

// `steps` 0: those of the long tier.
void CheckExamples(const Width& width, const std::string& prefix, uint64_t steps) {
  SpawnOptions spawn;
  spawn.backend = width.backend;
  // With more threads, cloths side by side would be shared out among them, and fewer than fill
  // lanes are stepped alone.
  if (width.copies > 1) spawn.flags = {"--threads=1"};
  const Client client = Client::SpawnServer(spawn);
  GoldenRows rows;
  for (const std::filesystem::path& file : SceneFiles()) {
    const v1::Scene scene = LoadCopies(file, width.copies);
    if (width.backend == "gl" && !IsForGl(scene)) continue;
    const uint64_t all = StepCount(scene) / width.long_part;
    rows[file.stem().string()] = PlayAndHash(client, scene, steps == 0 ? all : steps);
  }
  ExpectGolden(prefix + width.file, GoldenDevice(width.backend, client.GetServerInfo().device()),
               rows);
}

TEST_P(GoldenExamplesTest, Begin) {
  CheckExamples(GetParam(), "examples_", GetParam().short_steps);
}
TEST_P(GoldenExamplesLong, ToTheirEnd) {
  CheckExamples(GetParam(), "examples_long_", 0);
}

}  // namespace
}  // namespace drape::test
