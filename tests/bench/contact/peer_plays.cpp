#include "tests/bench/contact/peer_plays.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <vector>

#include "server/core/check.h"
#include "server/solver/self_contact/crossing_search.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

std::ostream& operator<<(std::ostream& out, const Vector3d& v) {
  return out << v.x() << ' ' << v.y() << ' ' << v.z();
}

void WriteColliders(const std::vector<Collider>& colliders, ShapeKind kind, std::ostream& out) {
  const auto is_wanted = [kind](const Collider& collider) { return collider.kind() == kind; };
  out << std::count_if(colliders.begin(), colliders.end(), is_wanted) << '\n';
  for (const Collider& collider : colliders) {
    if (!is_wanted(collider)) continue;
    const ColliderNumbers numbers = NumbersOf(collider);
    if (kind == ShapeKind::kPlane) {
      out << numbers.vector << ' ' << -numbers.vector.dot(numbers.point_m) << '\n';
    } else {
      out << numbers.point_m << ' ' << numbers.radius_m << '\n';
    }
  }
}

void WriteFrame(const test::Scene& scene, std::ostream& out) {
  const auto& colliders = scene.parameters.colliders;
  for (const Collider& collider : colliders) {
    DRAPE_CHECK(collider.kind() == ShapeKind::kPlane || collider.kind() == ShapeKind::kSphere,
                "peers get planes and spheres only");
  }
  WriteColliders(colliders, ShapeKind::kPlane, out);
  WriteColliders(colliders, ShapeKind::kSphere, out);
  out << scene.pin_targets_m.size() << '\n';
  for (size_t k = 0; k < scene.pin_targets_m.size(); ++k) {
    out << scene.model->pins()[k] << ' ' << scene.pin_targets_m[k] << '\n';
  }
}

struct PeerRow {
  uint32_t crossed = 0;    // frames
  uint64_t crossings = 0;  // most in a frame
  double max_strain = 0;
};

double MaxStrain(const SceneModel& model, const std::vector<Vector3d>& positions_m) {
  double largest = 0;
  for (const DistanceConstraint& link : model.constraints()) {
    const double length_m = (positions_m[link.i] - positions_m[link.j]).norm();
    largest = std::max(largest, std::abs(length_m / link.rest_length_m - 1));
  }
  return largest;
}

PeerRow RowOf(const ContactPlay& play, const std::filesystem::path& path) {
  const SceneModel& model = *play.scene.model;
  const uint64_t frame_bytes = uint64_t{3} * sizeof(float) * model.particle_count();
  DRAPE_CHECK(std::filesystem::file_size(path) == frame_bytes * play.frames,
              path.string() + " has another size than the frames of " + play.name);
  std::ifstream file(path, std::ios::binary);
  const ContactSurface surface(model);
  std::vector<float> numbers(size_t{3} * model.particle_count());
  std::vector<Vector3d> positions_m(model.particle_count());
  std::vector<self_contact::Vector3d> exact_m(model.particle_count());
  PeerRow row;
  for (uint32_t frame = 0; frame < play.frames; ++frame) {
    file.read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(frame_bytes));
    for (size_t i = 0; i < positions_m.size(); ++i) {
      const Vector3d p = Eigen::Map<const Eigen::Vector3f>(&numbers[3 * i]).cast<double>();
      positions_m[i] = p;
      exact_m[i] = self_contact::Vector3d{p.x(), p.y(), p.z(), 0};
    }
    const uint64_t crossings = self_contact::FindCrossings(surface, exact_m).size();
    row.crossed += crossings > 0;
    row.crossings = std::max(row.crossings, crossings);
    row.max_strain = std::max(row.max_strain, MaxStrain(model, positions_m));
  }
  return row;
}

}  // namespace

void WritePlay(const ContactPlay& play, const std::string& folder) {
  const std::string path = folder + "/" + play.name + ".play";
  std::ofstream out(path);
  out << std::setprecision(9);
  const SceneModel& model = *play.scene.model;
  const std::vector<Vector3d> rest_m = test::RestState(model).positions_m;
  out << model.particle_count() << ' ' << model.triangles().size() << ' ' << model.grid_columns()
      << ' ' << play.frames << '\n';
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    out << rest_m[i] << ' ' << play.scene.state.positions_m[i] << ' '
        << (model.inverse_masses_per_kg()[i] > 0) << '\n';
  }
  for (const auto& [a, b, c] : model.triangles()) out << a << ' ' << b << ' ' << c << '\n';
  test::Scene scene = play.scene;
  for (uint32_t frame = 0; frame < play.frames; ++frame) {
    play.change(frame, scene);
    WriteFrame(scene, out);
  }
  out.close();
  DRAPE_CHECK(out.good(), "cannot write " + path);
}

void MeasurePeers(Bench& bench, const std::string& folder, const ContactPlayOptions& options) {
  std::map<std::string, ContactPlay> plays;
  for (const ContactPlay& play : ContactPlays(options)) plays.emplace(play.name, play);
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".positions") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  Table table = bench.OpenTable(
      "contact_peers", {"scene", "label", "frames_with_crossings", "most_crossings", "max_strain"});
  for (const std::filesystem::path& path : paths) {
    const std::string stem = path.stem().string();
    const size_t dot = stem.find('.');
    const auto play = plays.find(stem.substr(0, dot));
    DRAPE_CHECK(dot != std::string::npos && play != plays.end(), "no scene of " + path.string());
    const PeerRow row = RowOf(play->second, path);
    table.Add({play->first, stem.substr(dot + 1), row.crossed, row.crossings, row.max_strain});
  }
}

}  // namespace drape::bench
