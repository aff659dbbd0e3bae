#include "drape/scene_file.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "client/src/errors.h"
#include "client/src/scenes/json_check.h"
#include "client/src/scenes/scene_check.h"
#include "client/src/scenes/spec_override.h"
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

template <class Message>
Message ToMessage(const json& value) {
  Message message;
  const auto status = google::protobuf::util::JsonStringToMessage(value.dump(), &message);
  if (!status.ok()) {
    throw LocalError(ErrorCode::kInvalidArgument, "BAD_JSON", status.message().ToString());
  }
  return message;
}

// One time step for the whole scene, in `scene` and in every cloth's settings. A spec may only
// repeat the scene's time step; --set settings.time_step_s replaces the scene's.
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

// A spec or a collider whose mesh is in a file.
struct MeshFileAt {
  std::string path;   // of the spec or collider, as in error messages
  int cloth = 0;      // of scene.cloths
  int collider = -1;  // of its environment; -1: the spec's own mesh
  v1::MeshFile file{};
};

// Takes the fields of MeshFile out of `owner`, the spec or collider at `place.path`, whose fields
// are checked, and puts an empty `mesh` in their place.
void TakeMeshFile(const google::protobuf::OneofDescriptor& meshes, MeshFileAt place, json* owner,
                  std::vector<MeshFileAt>* files) {
  if (!owner->is_object()) return;
  json fields = json::object();
  for (const char* name : {"mesh_file", "scale_m"}) {
    const auto found = owner->find(name);
    if (found == owner->end()) continue;
    if (!found->is_null()) fields[name] = *found;
    owner->erase(found);
  }
  if (fields.empty()) return;
  if (!fields.contains("mesh_file")) {
    throw BadField(place.path + ".scale_m", "needs mesh_file, which is not given");
  }
  for (int k = 0; k < meshes.field_count(); ++k) {
    const std::string& other = meshes.field(k)->name();
    if (!owner->contains(other) || (*owner)[other].is_null()) continue;
    throw BadField(place.path + ".mesh_file",
                   "only one of " + other + " and mesh_file may be given");
  }
  place.file = ToMessage<v1::MeshFile>(fields);
  (*owner)["mesh"] = json::object();
  files->push_back(std::move(place));
}

// Every mesh file of a scene whose fields are checked.
std::vector<MeshFileAt> TakeMeshFiles(json* scene) {
  const auto& topology = *v1::ClothSpec::descriptor()->FindOneofByName("topology");
  const auto& shape = *v1::Collider::descriptor()->FindOneofByName("shape");
  std::vector<MeshFileAt> files;
  const size_t cloth_count = scene->contains("cloths") ? scene->at("cloths").size() : 0;
  for (size_t k = 0; k < cloth_count; ++k) {
    json& cloth = scene->at("cloths")[k];
    if (!cloth.contains("spec")) continue;
    json& spec = cloth["spec"];
    const std::string path = "cloths[" + std::to_string(k) + "].spec";
    TakeMeshFile(topology, {.path = path, .cloth = static_cast<int>(k)}, &spec, &files);
    const json::json_pointer colliders_at("/environment/colliders");
    const size_t collider_count = spec.contains(colliders_at) ? spec[colliders_at].size() : 0;
    for (size_t c = 0; c < collider_count; ++c) {
      TakeMeshFile(shape,
                   {.path = path + ".environment.colliders[" + std::to_string(c) + "]",
                    .cloth = static_cast<int>(k),
                    .collider = static_cast<int>(c)},
                   &spec[colliders_at][c], &files);
    }
  }
  return files;
}

v1::Mesh ReadMeshFile(const std::filesystem::path& folder, const MeshFileAt& place) {
  const double scale_m = place.file.has_scale_m() ? place.file.scale_m() : 1;
  if (!(scale_m > 0) || !std::isfinite(scale_m)) {
    throw BadField(place.path + ".scale_m", "must be > 0, got " + NumberText(scale_m));
  }
  try {
    return LoadMesh(folder / std::string(place.file.mesh_file()), scale_m);
  } catch (const Error& error) {
    ErrorDetails details = error.details();
    details.violations.push_back({place.path + ".mesh_file", details.message});
    details.message = place.path + ".mesh_file: " + details.message;
    throw Error(std::move(details));
  }
}

}  // namespace

v1::Scene ParseScene(std::string_view json_text, const std::filesystem::path& folder,
                     std::span<const std::string> sets) {
  std::vector<SpecOverride> overrides;
  for (const std::string& text : sets) overrides.push_back(ParseOverride(text));
  json scene_json = ParseJson(json_text);
  ApplyOverrides(overrides, &scene_json);
  const MoreFields more[] = {{v1::ClothSpec::descriptor(), v1::MeshFile::descriptor()},
                             {v1::Collider::descriptor(), v1::MeshFile::descriptor()}};
  CheckJson(scene_json, *v1::Scene::descriptor(), "", more);
  const std::vector<MeshFileAt> mesh_files = TakeMeshFiles(&scene_json);
  auto scene = ToMessage<v1::Scene>(scene_json);
  const bool sets_time_step =
      std::any_of(overrides.begin(), overrides.end(),
                  [](const SpecOverride& override) { return override.path == kTimeStepPath; });
  ResolveTimeStep(sets_time_step, &scene);
  CheckScene(scene);
  for (const MeshFileAt& place : mesh_files) {
    v1::ClothSpec* spec = scene.mutable_cloths(place.cloth)->mutable_spec();
    v1::Mesh mesh = ReadMeshFile(folder, place);
    if (place.collider < 0) {
      *spec->mutable_mesh() = std::move(mesh);
    } else {
      *spec->mutable_environment()->mutable_colliders(place.collider)->mutable_mesh() =
          std::move(mesh);
    }
  }
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
