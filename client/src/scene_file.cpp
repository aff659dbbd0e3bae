#include "drape/scene_file.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "client/src/errors.h"
#include "client/src/json_check.h"
#include "client/src/scene_check.h"
#include "client/src/spec_override.h"
#include "drape/mesh_file.h"

namespace drape {
inline namespace client {
namespace {

using nlohmann::json;

constexpr double kDefaultTimeStepS = 1.0 / 60;
constexpr char kTimeStepPath[] = "settings.time_step_s";

void ApplyOverrides(const std::vector<SpecOverride>& overrides, json* scene) {
  if (!scene->is_object() || !scene->contains("cloths") || !(*scene)["cloths"].is_array()) return;
  for (json& cloth : (*scene)["cloths"]) {
    if (!cloth.is_object()) continue;  // the next check reports it
    for (const SpecOverride& override : overrides) ApplyOverride(override, &cloth["spec"]);
  }
}

v1::Scene ToMessage(const json& scene_json) {
  v1::Scene scene;
  const auto status = google::protobuf::util::JsonStringToMessage(scene_json.dump(), &scene);
  if (!status.ok()) {
    throw LocalError(ErrorCode::kInvalidArgument, "BAD_JSON", status.message().ToString());
  }
  return scene;
}

// One time step for the whole scene, in `scene` and in every cloth's settings. That of a spec may
// only repeat the scene's; --set settings.time_step_s replaces the scene's.
void ResolveTimeStep(bool is_overridden, v1::Scene* scene) {
  if (is_overridden && scene->cloths_size() > 0) {
    scene->set_time_step_s(scene->cloths(0).spec().settings().time_step_s());
  }
  if (!scene->has_time_step_s()) scene->set_time_step_s(kDefaultTimeStepS);
  for (int k = 0; k < scene->cloths_size(); ++k) {
    v1::StepSettings* settings = scene->mutable_cloths(k)->mutable_spec()->mutable_settings();
    if (settings->has_time_step_s() && settings->time_step_s() != scene->time_step_s()) {
      throw BadField("cloths[" + std::to_string(k) + "].spec." + kTimeStepPath,
                     "differs from time_step_s of the scene, which applies to every cloth");
    }
    settings->set_time_step_s(scene->time_step_s());
  }
}

// In a spec or a collider at `path`: the file replaced by what it holds.
template <class MeshOwner>
void ReadMeshFile(const std::filesystem::path& folder, const std::string& path, MeshOwner* owner) {
  if (!owner->has_mesh_file()) {
    if (!owner->has_scale_m()) return;
    throw BadField(path + ".scale_m", "needs mesh_file, which is not given");
  }
  const double scale_m = owner->has_scale_m() ? owner->scale_m() : 1;
  if (!(scale_m > 0) || !std::isfinite(scale_m)) {
    throw BadField(path + ".scale_m", "must be > 0, got " + NumberText(scale_m));
  }
  try {
    *owner->mutable_mesh() = LoadMesh(folder / std::string(owner->mesh_file()), scale_m);
  } catch (const Error& error) {
    ErrorDetails details = error.details();
    details.violations.push_back({path + ".mesh_file", details.message});
    details.message = path + ".mesh_file: " + details.message;
    throw Error(std::move(details));
  }
  owner->clear_scale_m();
}

void ReadMeshFiles(const std::filesystem::path& folder, v1::Scene* scene) {
  for (int k = 0; k < scene->cloths_size(); ++k) {
    v1::ClothSpec* spec = scene->mutable_cloths(k)->mutable_spec();
    const std::string path = "cloths[" + std::to_string(k) + "].spec";
    ReadMeshFile(folder, path, spec);
    auto* colliders = spec->mutable_environment()->mutable_colliders();
    for (int c = 0; c < colliders->size(); ++c) {
      ReadMeshFile(folder, path + ".environment.colliders[" + std::to_string(c) + "]",
                   colliders->Mutable(c));
    }
  }
}

}  // namespace

v1::Scene ParseScene(std::string_view json_text, const std::filesystem::path& folder,
                     std::span<const std::string> sets) {
  std::vector<SpecOverride> overrides;
  for (const std::string& text : sets) overrides.push_back(ParseOverride(text));
  json scene_json = ParseJson(json_text);
  ApplyOverrides(overrides, &scene_json);
  CheckJson(scene_json, *v1::Scene::descriptor(), "");
  v1::Scene scene = ToMessage(scene_json);
  const bool sets_time_step =
      std::any_of(overrides.begin(), overrides.end(),
                  [](const SpecOverride& override) { return override.path == kTimeStepPath; });
  ResolveTimeStep(sets_time_step, &scene);
  CheckScene(scene);
  ReadMeshFiles(folder, &scene);
  return scene;
}

v1::Scene LoadScene(const std::filesystem::path& path, std::span<const std::string> sets) {
  std::ifstream file(path, std::ios::binary);
  if (!file || !std::filesystem::is_regular_file(path)) {
    throw LocalError(ErrorCode::kNotFound, "NO_SCENE_FILE", "no scene file " + path.string());
  }
  const std::string text(std::istreambuf_iterator<char>(file), {});
  try {
    v1::Scene scene = ParseScene(text, path.parent_path(), sets);
    if (scene.name().empty()) scene.set_name(path.stem().string());
    return scene;
  } catch (const Error& error) {
    ErrorDetails details = error.details();
    details.message = path.string() + ": " + details.message;
    throw Error(std::move(details));
  }
}

uint64_t StepCount(const v1::Scene& scene) {
  return static_cast<uint64_t>(std::llround(scene.duration_s() / scene.time_step_s()));
}

uint64_t ClothCount(const v1::Scene& scene) {
  uint64_t count = 0;
  for (const v1::SceneCloth& cloth : scene.cloths()) count += cloth.has_count() ? cloth.count() : 1;
  return count;
}

uint64_t FirstStepAtOrAfter(double time_s, double time_step_s) {
  // k * time_step_s is off by a few ulp of time_s: far below a billionth of a step for any number
  // of steps that is ever run.
  constexpr double kRounding = 1e-9;
  return static_cast<uint64_t>(std::max(0.0, std::ceil(time_s / time_step_s - kRounding)));
}

}  // namespace client
}  // namespace drape
