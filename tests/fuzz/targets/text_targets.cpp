// Files as text: scenes and meshes of the client, tokens of the server.
#include <google/protobuf/util/json_util.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "drape/mesh_file.h"
#include "drape/scene_file.h"
#include "server/api/sha256.h"
#include "server/api/token_file.h"
#include "server/core/check.h"
#include "tests/fuzz/targets/message_mutator.h"
#include "tests/fuzz/targets/targets.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

// Any other exception than a refusal that says something ends the process.
template <class Read>
FuzzOutcome Outcome(Read read) {
  try {
    read();
    return FuzzOutcome::kAccepted;
  } catch (const Error& error) {
    DRAPE_CHECK(error.code() == ErrorCode::kInvalidArgument || error.code() == ErrorCode::kNotFound,
                error.what());
    DRAPE_CHECK(!error.reason().empty(), error.what());
    return FuzzOutcome::kRefused;
  }
}

FuzzOutcome ReadScene(std::string_view text) {
  return Outcome([&] {
    const v1::Scene scene = ParseScene(text, "/nowhere");
    DRAPE_CHECK(scene.time_step_s() > 0, "time step");
    DRAPE_CHECK(StepCount(scene) <= 1'000'000'000'000, "steps");
    DRAPE_CHECK(ClothCount(scene) >= 1, "cloths");
  });
}

// Small ones, and not those with mesh files.
std::vector<std::string> SceneSeeds() {
  constexpr size_t kLargest = 8000;
  std::vector<std::string> seeds;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("client/examples"))) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path());
    std::string text(std::istreambuf_iterator<char>(file), {});
    if (text.size() < kLargest && text.find("mesh_file") == std::string::npos) {
      seeds.push_back(std::move(text));
    }
  }
  std::ranges::sort(seeds);
  return seeds;
}

std::string MutateScene(std::string_view text, uint32_t seed) {
  v1::Scene scene;
  if (!google::protobuf::util::JsonStringToMessage(std::string(text), &scene).ok()) return {};
  MutateMessage(scene, seed);
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string changed;
  if (!google::protobuf::util::MessageToJsonString(scene, &changed, options).ok()) return {};
  return changed;
}

// A file in memory.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    DRAPE_CHECK(
        write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
        "cannot write to memory");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  const int descriptor_;
};

FuzzOutcome ReadMesh(std::string_view text) {
  const MemoryFile file(text);
  return Outcome([&] {
    const v1::Mesh mesh = LoadMesh(file.path());
    const v1::PackedArray &positions = mesh.positions_m(), &triangles = mesh.triangles();
    DRAPE_CHECK(positions.data().size() == 24ull * positions.shape(0), "positions");
    DRAPE_CHECK(triangles.data().size() == 12ull * triangles.shape(0), "triangles");
    DRAPE_CHECK(triangles.shape(0) > 0, "faces");
  });
}

FuzzOutcome ReadTokens(std::string_view text) {
  const auto tokens = api::TokenFile::Parse(std::string(text), "tokens");
  if (!tokens.ok()) {
    DRAPE_CHECK(tokens.status().reason() == "TOKEN_FILE_FAILED", tokens.status().ToString());
    return FuzzOutcome::kRefused;
  }
  if (const auto tenant = tokens->TenantOf("secret")) {
    DRAPE_CHECK(api::IsTenantName(*tenant), *tenant);
  }
  DRAPE_CHECK(!tokens->TenantOf(""), "nobody's token");
  return FuzzOutcome::kAccepted;
}

std::string HexOf(const std::string& bytes) {
  std::string digits;
  for (const char byte : bytes) {
    for (const int shift : {4, 0}) digits += "0123456789abcdef"[(byte >> shift) & 15];
  }
  return digits;
}

std::vector<std::string> TokenSeeds() {
  const std::string hash = HexOf(api::Sha256Of("secret"));
  return {"# tenants\nalice " + hash + "\n\nbob.2 " + HexOf(api::Sha256Of("b")) + "\n",
          "carol " + hash + "\r\n"};
}

}  // namespace

std::vector<FuzzTarget> TextTargets() {
  return {
      {"scene", ReadScene, SceneSeeds, MutateScene},
      {"obj", ReadMesh,
       [] {
         return std::vector<std::string>{
             "# a square\nv 0 0 0\nv 1 0 0\nv 1 1e0 0\nv 0 1 -0.5\nvt 0 1\nvn 0 0 1\n"
             "o one\nf 1/1/1 2/1/1 3/1/1 4//1\ng two\ns off\nf -1 -2 -3\n",
             "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\nl 1 2\r\np 1\r\nusemtl m\r\n"};
       }},
      {"tokens", ReadTokens, TokenSeeds},
  };
}

}  // namespace drape::test
